// Quadrics and the torus as exact rational patches (Piegl, Tiller 1997, chapter 7). Normals point outwards.
#pragma once

#include "smurf/patch.hpp"

namespace smurf::test {

// About z; u runs around the axis and v around the tube, both over [0, 4] with knots at whole numbers.
Patch nurbs_torus(double ring_radius, double tube_radius);
// u runs around z over [0, 4], v from the south pole to the north pole over [0, 2].
Patch nurbs_sphere(double radius);
// About z from z = 0 to `height`; u runs around over [0, 4], v upwards over [0, 1].
Patch nurbs_cylinder(double radius, double height);
// A bilinear patch over [0, 1]² through a, b (u = 1), c (v = 1) and d.
Patch bilinear_patch(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d);

}  // namespace smurf::test
