#include "reference/curvature.hpp"

#include <Eigen/Core>
#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>

#include "smurf/interrogator.hpp"

namespace smurf {
namespace {

constexpr double umbilic_tolerance = 1e-6;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// A unit vector at right angles to the unit vector n.
glm::dvec3 any_tangent(const glm::dvec3& n) {
  int least = 0;
  for (int a = 1; a < 3; a++) {
    if (std::abs(n[a]) < std::abs(n[least])) least = a;
  }
  glm::dvec3 axis(0.0);
  axis[least] = 1;
  return glm::normalize(glm::cross(n, axis));
}

}  // namespace

SurfaceFrame undefined_frame() {
  return {glm::dvec3(nan), nan, nan, glm::dvec3(nan), glm::dvec3(nan), PointStatus::undefined};
}

SurfaceFrame level_set_frame(const glm::dvec3& gradient, const glm::dmat3& hessian, int orientation, double flat) {
  const double length = std::hypot(gradient.x, gradient.y, gradient.z);
  if (!(length > 0) || !std::isfinite(length)) return undefined_frame();
  for (int a = 0; a < 3; a++) {
    if (!is_finite(hessian[a])) return undefined_frame();
  }
  SurfaceFrame frame{};
  frame.normal = double(orientation) / length * gradient;

  const glm::dvec3 u = any_tangent(frame.normal), v = glm::cross(frame.normal, u);
  const double factor = orientation / length;
  Eigen::Matrix2d shape;
  shape(0, 0) = factor * glm::dot(u, hessian * u);
  shape(1, 0) = shape(0, 1) = factor * glm::dot(u, hessian * v);
  shape(1, 1) = factor * glm::dot(v, hessian * v);
  if (!shape.allFinite()) return undefined_frame();

  // One Jacobi rotation makes it diagonal.
  Eigen::JacobiRotation<double> rotation;
  rotation.makeJacobi(shape, 0, 1);
  Eigen::Matrix2d vectors = Eigen::Matrix2d::Identity();
  vectors.applyOnTheRight(0, 1, rotation);
  shape.applyOnTheLeft(0, 1, rotation.adjoint());
  shape.applyOnTheRight(0, 1, rotation);
  const int first = shape(0, 0) >= shape(1, 1) ? 0 : 1;
  frame.k1 = shape(first, first);
  frame.k2 = shape(1 - first, 1 - first);
  frame.d1 = glm::normalize(vectors(0, first) * u + vectors(1, first) * v);
  frame.d2 = glm::cross(frame.normal, frame.d1);
  const double size = std::max(std::abs(frame.k1), std::abs(frame.k2));
  frame.status =
      frame.k1 - frame.k2 <= std::max(umbilic_tolerance * size, flat) ? PointStatus::umbilic : PointStatus::regular;
  return frame;
}

double normal_curvature(const SurfaceFrame& frame, const glm::dvec3& direction) {
  const double a = glm::dot(direction, frame.d1), b = glm::dot(direction, frame.d2);
  const double length = std::hypot(a, b);
  const double whole = std::hypot(direction.x, direction.y, direction.z);
  // A direction along the normal leaves a tangent part of rounding only.
  if (!(length > 1e-7 * whole) || !std::isfinite(length)) return nan;
  const double c = a / length, s = b / length;
  return frame.k1 * c * c + frame.k2 * s * s;
}

}  // namespace smurf
