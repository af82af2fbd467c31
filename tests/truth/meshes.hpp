// Meshes of surfaces whose answers are known.
#pragma once

#include "smurf/mesh.hpp"

namespace smurf::test {

// A torus about the z axis, great and small radius, of around × across quadrilaterals, each as two triangles; outward.
Mesh torus_mesh(double great, double small, std::uint32_t around, std::uint32_t across);

// A sphere by subdivision of an octahedron: 8·4^levels triangles; outward.
Mesh sphere_mesh(double radius, int levels, const glm::dvec3& centre = glm::dvec3(0.0));

// A cylinder about the z axis from z = 0 to `height` without its ends, in `around` × `along` quadrilaterals; outward.
Mesh cylinder_mesh(double radius, double height, std::uint32_t around, std::uint32_t along);

// The axis-aligned box of `cells`³ · 6 quadrilaterals from `lower` to `upper`; outward.
Mesh box_mesh(const glm::vec3& lower, const glm::vec3& upper, std::uint32_t cells);

// Triangles as long as they are many times wide, along the diagonals of cubes: boxes around them hold little of them.
Mesh slanted_strips(std::uint32_t count);

// What a surface is like at a point of it; normals outwards.
struct MeshTruth {
  glm::dvec3 normal;
  double k1, k2;
  glm::dvec3 d1;  // 0 at umbilics
};
// 1/small across, and along the great circle cos/(great + small·cos), which is less.
MeshTruth torus_truth(double great, double small, const glm::dvec3& p);
inline bool everywhere(const glm::dvec3&) { return true; }

// The same triangles, scaled and then moved, rounded to floats.
Mesh placed(const Mesh& mesh, double scale, const glm::dvec3& offset);

}  // namespace smurf::test
