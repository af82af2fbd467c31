// Stretches of stream surfaces as charts to walk on, evaluated by streamlines from the seed curve.
#pragma once

#include <vector>

#include "reference/stream/map.hpp"
#include "reference/stream/samples.hpp"
#include "reference/walk/charts.hpp"

namespace smurf {

class StreamCharts : public Charts {
 public:
  StreamCharts(const ReferenceStreamMap& map, const StreamSamples& samples) : map_(map), samples_(samples) {}

  ChartPoint point(std::uint32_t chart, const glm::dvec2& at) const override;
  glm::dvec2 lower(std::uint32_t chart) const override { return {map_.stretches()[chart].lower, map_.time().x}; }
  glm::dvec2 upper(std::uint32_t chart) const override { return {map_.stretches()[chart].upper, map_.time().y}; }
  std::vector<ChartPlace> same_point(const ChartPlace& place) const override;
  std::vector<ChartPlace> around_pole(const ChartPlace&, const SectionStart&) const override { return {}; }

 private:
  const ReferenceStreamMap& map_;
  const StreamSamples& samples_;
};

}  // namespace smurf
