// Section curves of surfaces s(u, v): followed in the parameters, over the borders of charts.
//
// F(u, v) = (s(u, v) - p)·(n x d) is zero on the curve. From a point of it a step goes along the curve's tangent in
// space, and Newton's method across the curve, within the surface, brings it back; a step is halved where the tangent
// turns by more than a few degrees. At a border of the chart's rectangle the step ends there, F = 0 being solved along
// it, and the curve goes on at the places that are the same point, where its tangent points into their charts.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "reference/walk/section.hpp"

namespace smurf {

struct ChartPoint {
  glm::dvec3 s{0.0}, u{0.0}, v{0.0};  // not finite where undefined
  bool ends = false;                  // the surface does not reach there
};

struct ChartPlace {
  std::uint32_t chart = 0;
  glm::dvec2 at{0.0};
};

class Charts {
 public:
  virtual ~Charts() = default;
  // Asked within the rectangle only.
  virtual ChartPoint point(std::uint32_t chart, const glm::dvec2& at) const = 0;
  virtual glm::dvec2 lower(std::uint32_t chart) const = 0;
  virtual glm::dvec2 upper(std::uint32_t chart) const = 0;
  // Other places, on borders of charts, that are the point of the surface at this place on a border.
  virtual std::vector<ChartPlace> same_point(const ChartPlace& place) const = 0;
  // The places to begin at around a point in which a side of the chart is collapsed, close to it, on the plane of the
  // section; none where the place is none of such.
  virtual std::vector<ChartPlace> around_pole(const ChartPlace& place, const SectionStart& start) const = 0;
};

// From start.location, the point at `place`. The part of what is reached is the number of a chart.
SectionEnd follow_section(const Charts& charts, const SectionStart& start, const ChartPlace& place);

}  // namespace smurf
