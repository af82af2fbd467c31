// All roots of f(origin + t·direction) = isovalue of a sampled field along a ray, in double precision.
//
// The ray is clipped to the domain and split at every crossing with a plane between cells. In each span the
// field is a polynomial of degree 3 or 9, taken up as a Chebyshev series from as many samples. Its
// extrema are all found (polynomial.hpp); between them it is monotone, so a root is a change of sign, and is
// counted once because the signs at the ends of spans are carried along the ray.
//
// "On the surface" means |f - isovalue| <= tolerance·scale, scale being the largest |sample - isovalue| of the
// cell's taps (of its coefficients for the B-spline), or within rounding of the samples.
// A stretch of the ray on the surface is
//   isolated    when the field is monotone through it: exactly one root, given to the last bits
//   tangent     when it has an extremum: a double root, two very close roots, or none
//   unresolved  when it begins or ends with the ray, the domain or an undefined cell, or is longer than 1/100 of a cell
// Planes of the domain take in what lies within 1e-9 cell of them, so that rays along them are not left to rounding.
#pragma once

#include <memory>
#include <vector>

#include "reference/grid/field.hpp"
#include "reference/surface.hpp"

namespace smurf {

class RayRoots {
 public:
  RayRoots(std::shared_ptr<const GridField> field, double isovalue, double tolerance = 1e-9);

  const std::shared_ptr<const GridField>& field() const { return field_; }
  double isovalue() const { return isovalue_; }

  // Appends the hits in ascending order. The ray must be valid (finite, a direction, t_min <= t_max).
  void find(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const;

  // How far the ray is from a change in the number of its roots: the least |f - isovalue| / scale
  struct Margins {
    double extremum;  // ... over all local extrema along the ray
    double end;       // ... where the ray begins and ends, enters and leaves the domain and undefined cells
  };
  Margins margins(const ReferenceRay& ray) const;
  double near_tangency(const ReferenceRay& ray) const { return margins(ray).extremum; }

 private:
  std::shared_ptr<const GridField> field_;
  double isovalue_;
  double tolerance_;
};

}  // namespace smurf
