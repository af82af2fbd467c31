// Bézier and NURBS patches of surfaces whose answers are known, and points of patches by another way than pieces:
// de Boor's algorithm on the whole patch.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#include "patches/bezier.hpp"
#include "smurf/patch.hpp"

namespace smurf::test {

// Exact tori about the z axis, outward, as nine by nine points of quarter circles, and as two by two patches of half
// circles, whose middle control points lie at infinity (weight 0).
Patch nurbs_torus(double great, double small);
std::vector<Patch> torus_of_half_circles(double great, double small);
// About the z axis, outward: the sphere with both ends of v collapsed, the cylinder from z = 0.
Patch nurbs_sphere(double radius);
Patch nurbs_cylinder(double radius, double height);
// A bicubic patch that lies over itself: x by a cubic of u and y by one of v, each of which takes some values three
// times, so that rays about along z meet it up to nine times.
Patch folded_patch();
// count × count bicubic patches that meet in edges to the bit, of a sheet over [0, 1]².
std::vector<Patch> quilt(int count);

// The patch with its parameters the other way around in u: the same points, the other orientation.
Patch reversed(const Patch& patch);

// With derivatives. At the ends of its range and within.
PatchPoint point_of(const Patch& patch, double u, double v);

// A side of a patch as a curve of an edge parameter in [0, 1]: sides as in host/patches/topology.hpp.
struct Side {
  std::size_t patch;
  int side;
  bool backwards = false;

  glm::dvec2 place(const std::vector<Patch>& patches, double along) const;
};
// Two sides that are one curve, found by samples within `gap`; sides that are a point, and those that more than two
// share, are left out.
struct SharedEdge {
  Side a, b;
};
std::vector<SharedEdge> shared_edges(const std::vector<Patch>& patches, double gap);
// Sides that are one point.
std::vector<Side> collapsed_sides(const std::vector<Patch>& patches, double gap);

// The greatest side of the box around the patches' points that are not at infinity.
double extent_of(const std::vector<Patch>& patches);

}  // namespace smurf::test
