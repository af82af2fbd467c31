// Where facets end: sides that are one point, and how wide the gaps are between sides that meet.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "reference/parametric/facets.hpp"

namespace smurf {

class ParametricSurface;

constexpr std::uint32_t no_pole = 0xffffffffu;

struct ReferenceSide {
  std::uint32_t facet = 0;
  int side = 0;
  double gap = 0;  // to the side that it meets, if there is one
  std::uint32_t pole = no_pole;
};

// A point that sides are collapsed to.
struct ReferencePole {
  glm::dvec3 position{0.0};
  double radius = 0;  // of what the sides still extend over
  std::vector<ReferenceSide> sides{};
};

class ReferenceBorders {
 public:
  ReferenceBorders(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ParametricSurface& surface,
                   double extent);
  const ReferenceSide& side(std::uint32_t facet, int side) const { return sides_[4 * facet + std::size_t(side)]; }
  std::span<const ReferencePole> poles() const { return poles_; }

 private:
  void find_poles(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, double extent);
  void find_gaps(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ParametricSurface& surface,
                 double extent);

  std::vector<ReferenceSide> sides_;
  std::vector<ReferencePole> poles_;
};

// On the side, `along` it from 0 to 1.
glm::dvec2 place_on_side(const ReferenceFacet& facet, int side, double along);
// The derivative that points into the facet at a place on the side.
glm::dvec3 inwards(const ReferenceJet& jet, int side);

// How many sheets of a surface pass a line of the direction d at a point, where they have borders. Each sheet is a fan
// of directions from the point, in order. Lines beside it, moved to all sides, meet 1 where the surface passes through,
// 0 or 2 at a silhouette, 0 or 1 where it ends: what the greatest number of these meet counts, and the least where all
// of them meet an odd number.
int sheets_passed(std::span<const std::vector<glm::dvec3>> fans, const glm::dvec3& d);

}  // namespace smurf
