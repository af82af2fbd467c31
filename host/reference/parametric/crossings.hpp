// All places where a line meets a parametric surface, by Newton's iteration from every cell that the line comes near,
// and from ever smaller ones where the surface runs along it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "reference/parametric/borders.hpp"
#include "reference/parametric/cells.hpp"
#include "reference/parametric/facets.hpp"
#include "reference/parametric/search.hpp"
#include "smurf/interrogator.hpp"

namespace smurf {

struct ParametricCrossing {
  std::uint32_t facet = 0;
  double u = 0, v = 0;
  double t = 0, uncertainty = 0;  // as in ReferenceHit
  HitStatus status = HitStatus::isolated;
  glm::dvec3 place{0.0};
  double slope = 0;  // of the normal against the direction, both of length 1
  std::uint32_t pole = no_pole;
};

class ReferenceCrossings {
 public:
  ReferenceCrossings(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ReferenceCells& cells,
                     const ReferenceBorders& borders, double extent);

  // Of the line o + t·d for t in [low, high], in order of t as a float and of parts.
  std::vector<ParametricCrossing> find(const glm::dvec3& origin, const glm::dvec3& direction, double low,
                                       double high) const;

 private:
  struct OnBorder;
  std::optional<OnBorder> on_border(const LineRoot& root) const;
  std::vector<ParametricCrossing> at(const ReferencePole& pole, std::uint32_t number, const glm::dvec3& d) const;

  const std::vector<std::unique_ptr<ReferenceFacet>>& facets_;
  const ReferenceCells& cells_;
  const ReferenceBorders& borders_;
  double extent_;
  std::vector<bool> flat_;  // facets that lie in a plane
};

}  // namespace smurf
