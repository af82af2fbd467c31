// All roots of f(origin + t·direction) = level of a function along a ray, in double precision.
//
// The ray is clipped to the domain. What is left of it is parametrised by u in [0, 1] from the point of entry, so that
// far origins and the length of the direction cost no precision, and is cut into pieces on which the function is a
// Chebyshev series:
//   polynomials   16 pieces. A series of the polynomial's degree is exact; beyond degree 16 (and up to 60) pieces are
//                 halved until what is beyond the 16th coefficient is at most 1e-10 of the scale.
//   others        256 pieces, halved until the series of degree 16 agrees with the function at 8 more points to 1e-10
//                 of the scale
// or to what is known of the function for its rounding; the scale is the sum of the coefficients' magnitudes. The
// extrema of a series are all found by the ladder of derivatives; between them the function itself is monotone, so that
// a root is a change of its sign, and is polished on the function.
//
// Halving ends, too, where bounds of the function over the piece's box tell that it is on one side of the level. Pieces
// of 1e-9 of the span without a series are rough. A change of sign in one is followed to the last bits: if the function
// gets small there, it has a kink and a root; else it has a pole or a step, and no root. Signs do not carry over poles,
// steps, and where the function is undefined (which is found where it is for all samples of a piece, and its border to
// 1e-9 of the span) or infinite.
//
// "On the surface" means |f - level| <= tolerance·scale, of the piece, or within rounding: the width of the function's
// bounds over the box of the rounding errors of a point. Stretches on the surface are isolated, tangent and unresolved
// as in RayRoots, a plateau being longer than 1/1000 of the span. Hits in rough pieces of more than one change of sign
// are unresolved, and all that come after a ray took 65536 pieces and whose piece was no series; after that, pieces
// that are undefined in part are left out.
//
// Not found: what polynomials cannot have, features narrower than the sampling (up to 1/2600 of the span) that leave no
// trace outside, as a thin rod of a union may.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "reference/surface.hpp"
#include "surfaces/implicit/definition.hpp"

namespace smurf {

struct CompiledFunction;

class FunctionRoots {
 public:
  FunctionRoots(std::shared_ptr<const ImplicitFunction> function, const Domain& domain, double level,
                double tolerance = 1e-9);
  // The same function elsewhere or at another level, without another look at it.
  FunctionRoots with(const Domain& domain, double level) const;

  const std::shared_ptr<const ImplicitFunction>& function() const;
  const Domain& domain() const { return domain_; }
  double level() const { return level_; }
  std::size_t bytes() const;

  // Appends the hits in ascending order. The ray must be valid (finite, a direction, t_min <= t_max).
  void find(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const;

  // How far the ray is from a change in the number of its roots: the least |f - level| / magnitude, which is about that
  // of the terms that make up f there: its rounding error over the machine's epsilon. So are margins of hits.
  struct Margins {
    double extremum;  // ... over all local extrema along the ray
    double end;       // ... where the ray begins and ends, enters and leaves the domain and where f is undefined
  };
  Margins margins(const ReferenceRay& ray) const;

 private:
  std::shared_ptr<const CompiledFunction> compiled_;
  Domain domain_;
  double level_;
  double tolerance_;

  FunctionRoots(std::shared_ptr<const CompiledFunction> compiled, const Domain& domain, double level, double tolerance)
      : compiled_(std::move(compiled)), domain_(domain), level_(level), tolerance_(tolerance) {}
};

}  // namespace smurf
