// Surfaces s(u, v) for the reference: smooth parts, each a rectangle of parameters with a function that may be
// evaluated beyond it, too. An expression is one facet; a patch has one for each rectangle between knots, evaluated by
// basis functions on the knots (Piegl, Tiller 1997, A2.3 and A4.4).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

namespace smurf {

class ParametricSurface;

// Not finite where the surface is undefined.
struct ReferenceJet {
  glm::dvec3 s{0.0}, u{0.0}, v{0.0};
  glm::dvec3 uu{0.0}, uv{0.0}, vv{0.0};
};

class ReferenceFacet {
 public:
  virtual ~ReferenceFacet() = default;
  // Derivatives up to `order`, 0 to 2. May be called by threads at once.
  virtual ReferenceJet at(double u, double v, int order) const = 0;

  std::uint32_t part = 0;
  glm::dvec2 lower{0.0}, upper{1.0};
  // The whole part's range: what tolerances of parameters are relative to, and what the facet's sides are borders of.
  glm::dvec2 part_lower{0.0}, part_upper{1.0};
  // Whether the surface ends at the side, or goes on at another place: u = least, u = greatest, v = least, v =
  // greatest.
  std::array<bool, 4> border{};

  glm::dvec2 range() const { return part_upper - part_lower; }
};

std::vector<std::unique_ptr<ReferenceFacet>> reference_facets(const ParametricSurface& surface);

}  // namespace smurf
