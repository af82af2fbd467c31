// How many roots an algebraic surface has on a ray, by Sturm's theorem: what hits on such surfaces are judged by. It
// shares no method with the kernels (Bernstein form and intervals, in float) or the reference (Chebyshev series and
// derivatives, in double).
//
// The expression is evaluated with polynomials in u for x, y and z, where t = middle + half·u and u is in [-1, 1] on
// the part of the ray that is asked about. The floats of the ray and the doubles of the expression are taken as exact.
// Coefficients are 113-bit numbers, each with a proved bound on its error, and so are the values of the chain: a sign
// is certain, or known to be uncertain. Where a count depends on an uncertain sign the ray is `doubtful`; that takes
// roots closer than some 1e-11 of the part, or one at its very end.
#pragma once

#include <limits>
#include <vector>

#include "expression/graph.hpp"
#include "smurf/rays.hpp"
#include "smurf/surface.hpp"
#include "truth/jet.hpp"

namespace smurf::test {

#if defined(__SIZEOF_FLOAT128__)
__extension__ typedef __float128 Quad;
#else  // where a long double is as long
using Quad = long double;
static_assert(std::numeric_limits<Quad>::digits == 113, "no number type of 113 bits");
#endif

// All numbers within `radius` of `middle`.
struct Ball {
  Quad middle = 0;
  double radius = 0;

  Ball() = default;
  Ball(double exact) : middle(exact) {}  // NOLINT: numbers are balls
  Ball(Quad the_middle, double the_radius) : middle(the_middle), radius(the_radius) {}

  bool is_zero() const { return middle == 0 && radius == 0; }
  int sign() const;  // 0 where it is uncertain, or zero
};
Ball operator-(const Ball& a);
Ball operator+(const Ball& a, const Ball& b);
Ball operator-(const Ball& a, const Ball& b);
Ball operator*(const Ball& a, const Ball& b);
Ball operator/(const Ball& a, double b);

using BallPolynomial = std::vector<Ball>;  // coefficients of 1, u, u², …

// Distinct real roots in (-1, 1), ascending.
struct DistinctRoots {
  std::vector<double> at;
  bool doubtful = false;
};
DistinctRoots distinct_roots(BallPolynomial p);

// A part of a ray; empty when first > last.
struct RayPart {
  double first, last;
  bool contains(double t) const { return t >= first && t <= last; }
};

// [t_min, t_max] in the domain grown by `margin` on all sides (shrunk where it is negative).
RayPart part_of(const Domain& domain, const Ray& ray, double margin);

class AlgebraicSurface {
 public:
  // Throws std::invalid_argument when the expression is no polynomial as it is written. Keeps a copy of what it needs.
  AlgebraicSurface(const expression::Graph& graph, expression::NodeId f);

  int degree() const { return degree_; }

  BallPolynomial along(const Ray& ray, const RayPart& part) const;
  // In t. None where the part is empty.
  DistinctRoots roots(const Ray& ray, const RayPart& part) const;

  // Value and derivatives at a point, by the rules of products and powers.
  Jet jet(const glm::dvec3& point) const;
  // |∇f| over the size of the second derivatives: about how far away f has a point where the gradient vanishes, if it
  // has one nearby (as far again at a cusp). Elsewhere not above the lesser radius of curvature.
  double distance_of_singularity(const glm::dvec3& point) const;

 private:
  expression::Program program_;
  int degree_ = -1;
};

}  // namespace smurf::test
