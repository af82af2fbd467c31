#include "reference/walk/section.hpp"

#include <algorithm>
#include <cmath>

namespace smurf {

using glm::dvec3;

namespace {

constexpr double least_tangent = 1e-5;  // of a direction's length, in the tangent plane

double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

dvec3 tangent_direction(const dvec3& v, const dvec3& n, double least) {
  const double most = largest(v);
  if (!(most > 0) || !std::isfinite(most)) return dvec3(0.0);
  const dvec3 whole = v / most;
  dvec3 t = whole - glm::dot(whole, n) * n;
  const double left = glm::length(t);
  if (!(left >= least * glm::length(whole)) || !(left > 0)) return dvec3(0.0);
  t /= left;
  return glm::normalize(t - glm::dot(t, n) * n);
}

dvec3 carried_direction(const dvec3& d, const dvec3& from, const dvec3& to) {
  const dvec3 axis = glm::cross(from, to);
  const double sine = glm::length(axis), cosine = glm::dot(from, to);
  // Rodrigues' formula about the axis; k is its unit vector.
  dvec3 turned = d;
  if (cosine < -0.999) {
    turned = -d;
  } else if (sine > 0) {
    const dvec3 k = axis / sine;
    turned = cosine * d + sine * glm::cross(k, d) + (1 - cosine) * glm::dot(k, d) * k;
  }
  return tangent_direction(turned, to, 0);
}

ReferenceWalker walk_start(const dvec3& point, const dvec3& location, const dvec3& normal, const dvec3& direction,
                           double tolerance) {
  ReferenceWalker walker{.location = point};
  const double size = std::max(largest(point), largest(location));
  // Points are floats.
  if (!(glm::distance(location, point) <= tolerance + 8 * double(0x1p-24f) * size)) {
    walker.status = WalkStatus::off_surface;
    return walker;
  }
  if (!std::isfinite(glm::length(normal))) {
    walker.status = WalkStatus::undefined;
    return walker;
  }
  walker.normal = normal;
  walker.direction = tangent_direction(direction, normal, least_tangent);
  if (walker.direction == dvec3(0.0)) walker.status = WalkStatus::no_direction;
  else walker.location = location;
  return walker;
}

SectionStart section_start(const ReferenceWalker& from, double distance) {
  return {from.location, from.normal, from.direction, distance};
}

ReferenceWalker walk_end(const ReferenceWalker& from, const SectionEnd& end, const dvec3& normal) {
  ReferenceWalker to{.location = end.location, .part = end.part, .u = end.u, .v = end.v, .status = end.outcome};
  if (end.outcome != WalkStatus::unreachable) to.chord = glm::distance(end.location, from.location);
  if (std::isfinite(glm::length(normal))) {
    to.normal = normal;
    to.direction = carried_direction(from.direction, from.normal, normal);
  } else if (goes_on(to.status)) {
    to.status = WalkStatus::undefined;
  }
  return to;
}

}  // namespace smurf
