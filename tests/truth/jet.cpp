#include "truth/jet.hpp"

#include <cmath>

namespace smurf::test {

Differential differential_of(const Jet& jet) {
  const double length = glm::length(jet.gradient);
  const glm::dvec3 n = -jet.gradient / length;

  // Any frame of the tangent plane: start from the axis that is least along the normal.
  const glm::dvec3 a = glm::abs(n);
  const glm::dvec3 axis = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                          : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                   : glm::dvec3(0, 0, 1);
  const glm::dvec3 u = glm::normalize(glm::cross(n, axis));
  const glm::dvec3 v = glm::cross(n, u);

  // dn restricted to the tangent plane is -H/|gradient| there.
  const double uu = -glm::dot(u, jet.hessian * u) / length;
  const double uv = -glm::dot(u, jet.hessian * v) / length;
  const double vv = -glm::dot(v, jet.hessian * v) / length;

  const double mean = 0.5 * (uu + vv);
  const double half_difference = 0.5 * (uu - vv);
  const double radius = std::hypot(half_difference, uv);
  const double angle = 0.5 * std::atan2(uv, half_difference);

  Differential out;
  out.normal = n;
  out.k1 = mean + radius;
  out.k2 = mean - radius;
  out.mean = mean;
  out.gauss = uu * vv - uv * uv;
  out.d1 = std::cos(angle) * u + std::sin(angle) * v;
  out.d2 = glm::cross(n, out.d1);
  return out;
}

double normal_curvature_along(const Differential& surface, const glm::dvec3& direction) {
  const double c = glm::dot(direction, surface.d1);
  const double s = glm::dot(direction, surface.d2);
  return (surface.k1 * c * c + surface.k2 * s * s) / (c * c + s * s);
}

Jet pulled_back(const Jet& jet, const glm::dmat3& a) {
  const glm::dmat3 transposed = glm::transpose(a);
  return {jet.value, transposed * jet.gradient, transposed * jet.hessian * a};
}

}  // namespace smurf::test
