// Value, gradient and Hessian of a scalar field at a point, and what they say about the level set through it.
#pragma once

#include <glm/glm.hpp>

namespace smurf::test {

struct Jet {
  double value = 0;
  glm::dvec3 gradient{0.0};
  glm::dmat3 hessian{0.0};
};

// Of the level set through a point; the normal is -gradient/|gradient| and k1 >= k2 are the curvatures of dn, so
// that both are positive where the surface bends away from its normal.
struct Differential {
  glm::dvec3 normal{0.0};
  double k1 = 0, k2 = 0, gauss = 0, mean = 0;
  glm::dvec3 d1{0.0}, d2{0.0};
};

// By the shape operator in an orthonormal tangent frame. The gradient must not vanish.
Differential differential_of(const Jet& jet);

// k1 cos² + k2 sin² along the tangential part of `direction`, which must not vanish.
double normal_curvature_along(const Differential& surface, const glm::dvec3& direction);

// The jet of x -> f(A x + b) as seen from x, given f's at A x + b.
Jet pulled_back(const Jet& jet, const glm::dmat3& a);

}  // namespace smurf::test
