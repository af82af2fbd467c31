// Meshes in double precision: rays against all triangles, with exact decisions; normals and curvature at hits; nearest
// points.
//
// ---- Which triangles a ray crosses
//
// Each ray is moved by an infinitesimal vector e = (e_x, e_y, e_z), e_x >> e_y >> e_z > 0: its origin becomes o + e,
// its direction d stays. A triangle is crossed when the moved line passes through its inside. The moved line is a true
// line in general position, the same for all triangles, so that it passes through no vertex, no edge and into no plane
// that is parallel to it. Therefore, for every ray:
//   - at a shared edge or vertex the triangles around it are crossed as often as a line beside it crosses them: once
//   where the surface
//     passes from one side to the other, twice or not at all at a silhouette;
//   - a triangle in whose plane the ray lies is not crossed;
//   - a mesh in which every edge has an even number of triangles is crossed an even number of times.
// The side of the line to the directed edge (a, b) is the sign of
//   D(a, b) = det[d, a-o, b-o],   with the moved origin D + det[d, a-o-e, b-o-e] - D = D + e·(d x (b-a)),
// as D is affine in o. So the side is that of the first of these numbers that is not zero:
//   D(a, b),  (d x (b-a))_x,  (d x (b-a))_y,  (d x (b-a))_z.
// It changes its sign when a and b are swapped, and depends on nothing but the ray and the two points, so that all
// triangles agree on it.
// All four are zero only for an edge parallel to d. Then every triangle of this edge is parallel to d: det[d, b-a, c-a]
// = 0, and it is not crossed. Another triangle (a, b, c) is crossed when D(a, b), D(b, c), D(c, a) have the same side.
// All signs are exact: products of doubles are summed without rounding where a bound on the error does not decide.
//
// The numbers of a hit are those of the ray as it is: t = det[a-o, b-a, c-a] / det[d, b-a, c-a], and weights of the
// corners a, b, c in proportion to D(b, c), D(c, a), D(a, b), never negative. They are quotients of exact sums, right
// to the last places however far the origin and however thin the triangle. A hit is kept when t lies in [t_min, t_max].
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "reference/curvature.hpp"
#include "reference/surface.hpp"
#include "smurf/mesh.hpp"

namespace smurf {

// A point of triangle (a, b, c): (1-u-v)·a + u·b + v·c; u, v >= 0 and u + v <= 1.
struct MeshPoint {
  std::uint32_t face = 0;
  double u = 0, v = 0;
};

struct MeshHit {
  double t = 0;
  MeshPoint at;
};

struct NearestMeshPoint {
  MeshPoint at;
  double distance = 0;
};

class ReferenceMesh {
 public:
  explicit ReferenceMesh(const Mesh& mesh);
  ~ReferenceMesh();

  // The hits in [t_min, t_max], sorted by t and among equals by face; with `first_only` the first of them.
  std::vector<MeshHit> hits(const ReferenceRay& ray, bool first_only) const;

  std::size_t face_count() const { return mesh_.face_count(); }
  glm::dvec3 location(const MeshPoint& point) const;
  glm::dvec3 face_normal(std::uint32_t face) const;
  // Vertex normals (reference/mesh/vertices.hpp) weighted by barycentrics.
  glm::dvec3 interpolated_normal(const MeshPoint& point) const;

  // The normal, by choice of the face or interpolated, and the curvature: the vertices' tensors
  // (reference/mesh/vertices.hpp) weighted by barycentrics, restricted to the plane of the normal. `boundary` where a
  // vertex of weight lies on the boundary, so that its neighbours lie to one side; `undefined` with NaN as curvatures,
  // but a normal, where one has no curvature.
  // The vertices' tensors are computed when first asked for.
  SurfaceFrame measure(const MeshPoint& point, bool of_face) const;

  // The nearest point, of the least face among equals. Ranges over all triangles.
  NearestMeshPoint nearest(const glm::dvec3& point) const;

  std::size_t bytes() const;

 private:
  struct Box {
    glm::dvec3 lower, upper;
  };
  struct Properties;
  std::span<const std::uint32_t> block(std::size_t number) const;

  Mesh mesh_;
  std::vector<std::uint32_t> order_;  // of triangles: those that follow each other lie near each other
  std::vector<Box> blocks_;           // around so many of them at a time
  std::unique_ptr<Properties> properties_;
};

}  // namespace smurf
