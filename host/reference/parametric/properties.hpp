// Normal and curvature of a parametric surface from its fundamental forms, their limits where it is singular, and the
// nearest point of the surface.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "reference/curvature.hpp"
#include "reference/parametric/borders.hpp"
#include "reference/parametric/cells.hpp"
#include "reference/parametric/facets.hpp"

namespace smurf {

struct ParametricPlace {
  std::uint32_t facet = 0;
  double u = 0, v = 0;
};

class ReferenceProperties {
 public:
  ReferenceProperties(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ReferenceCells& cells,
                      const ReferenceBorders& borders, double extent);

  // The place of these coordinates of a part; they may come from floats, which miss the ends of ranges by a rounding.
  // False where the part has no such place.
  bool locate(std::uint32_t part, double u, double v, ParametricPlace& place) const;
  // At a collapsed side the coordinate without a meaning is made the start of its range.
  SurfaceFrame measure(ParametricPlace& place) const;
  // False where nothing is near, as of points that are not finite.
  bool nearest(const glm::dvec3& point, ParametricPlace& place) const;

 private:
  SurfaceFrame regular(const ReferenceJet& jet) const;
  SurfaceFrame limit(const ReferencePole& pole) const;
  SurfaceFrame interior_limit(const ParametricPlace& place) const;

  const std::vector<std::unique_ptr<ReferenceFacet>>& facets_;
  const ReferenceCells& cells_;
  const ReferenceBorders& borders_;
  double extent_;
  std::vector<std::uint32_t> first_facet_;  // of each part, and one more
  std::vector<SurfaceFrame> limits_;        // of poles
};

}  // namespace smurf
