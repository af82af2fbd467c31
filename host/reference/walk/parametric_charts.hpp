// Facets of parametric surfaces as charts to walk on. What lies beyond a side is found in space: sides on which the
// point is, too, within the gap between sides that meet. Nothing of the host's topology of patches is used.
#pragma once

#include <memory>
#include <vector>

#include "reference/parametric/borders.hpp"
#include "reference/walk/charts.hpp"

namespace smurf {

class ParametricCharts : public Charts {
 public:
  ParametricCharts(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ReferenceBorders& borders,
                   double extent);

  ChartPoint point(std::uint32_t chart, const glm::dvec2& at) const override;
  glm::dvec2 lower(std::uint32_t chart) const override { return facets_[chart]->lower; }
  glm::dvec2 upper(std::uint32_t chart) const override { return facets_[chart]->upper; }
  std::vector<ChartPlace> same_point(const ChartPlace& place) const override;
  std::vector<ChartPlace> around_pole(const ChartPlace& place, const SectionStart& start) const override;

 private:
  struct Box {
    glm::dvec3 lower, upper;
  };

  const std::vector<std::unique_ptr<ReferenceFacet>>& facets_;
  const ReferenceBorders& borders_;
  double extent_;
  std::vector<Box> boxes_;  // of sides, four of each facet
};

}  // namespace smurf
