// Section curves of surfaces, in double precision: what following one from a point comes to.
//
// The plane through p is spanned by the unit normal n and the unit tangent d there. The curve in which it cuts the
// surface is followed from p on the side of d, up to the first point at the chord r from p.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "reference/surface.hpp"

namespace smurf {

struct SectionStart {
  glm::dvec3 location{0.0};
  glm::dvec3 normal{0.0};     // unit
  glm::dvec3 direction{0.0};  // unit, perpendicular to the normal
  double chord = 0;

  glm::dvec3 across() const { return glm::cross(normal, direction); }  // the plane's normal
};

struct SectionEnd {
  glm::dvec3 location{0.0};
  WalkStatus outcome = WalkStatus::unresolved;
  std::uint32_t part = 0;  // surface coordinates, of kinds that have them; for s(u, v) the number of a chart
  double u = 0, v = 0;
};

constexpr double section_crease_cosine = 0.8660254037844387;  // 30°

// d, perpendicular to the unit normal `from`, turned by the rotation about from × to that turns `from` into `to`; where
// they are opposite, by half a turn about the axis from × d. Unit, and perpendicular to `to`.
glm::dvec3 carried_direction(const glm::dvec3& d, const glm::dvec3& from, const glm::dvec3& to);

// A walk's start at `point`, for which the surface has the location and the unit normal (of NaN where it has none).
ReferenceWalker walk_start(const glm::dvec3& point, const glm::dvec3& location, const glm::dvec3& normal,
                           const glm::dvec3& direction, double tolerance);
SectionStart section_start(const ReferenceWalker& from, double distance);
// Where a section curve has led to, with the unit normal there.
ReferenceWalker walk_end(const ReferenceWalker& from, const SectionEnd& end, const glm::dvec3& normal);

// The part of v perpendicular to the unit vector n, with length 1; 0 where it is less than `least` of v.
glm::dvec3 tangent_direction(const glm::dvec3& v, const glm::dvec3& n, double least);

}  // namespace smurf
