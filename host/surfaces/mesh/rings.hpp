// What the kernels that compute normals and curvature at the vertices of a mesh read (kernels/mesh/layout.inc).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "smurf/mesh.hpp"
#include "smurf/values.hpp"

namespace smurf {

// The power of two by which coordinates are multiplied on the device, so that the greatest is 1 to 2: products of three
// have room in floats then, and powers of two round nothing. (Coordinates below 2^-126 of the greatest may be lost.)
float mesh_unit(const Mesh& mesh);

// The triangles about each vertex, and the vertices' places in lengths of 1 / `unit`.
struct MeshCorners {
  Values<std::uint32_t> corners;
  Values<glm::vec4> places;
};
// Throws Error (memory) when there are more words than kernels can number.
MeshCorners corners_by_vertex(const Mesh& mesh, float unit);

// The plan by which the device makes the rings of the vertices, `ring_words` in all (kernels/mesh/rings.inc).
struct MeshRings {
  Values<std::uint32_t> plan;
  std::size_t ring_words;
};

// From what the device tells of the sizes of rings. The plan has the rings that it cannot make: of vertices that do not
// lie within the surface, or are near one that does not or that has very few or many neighbours; their places get their
// states. The mesh's topology is found only where a vertex has more than one fan of triangles, or they do not run
// through its edges in turn.
MeshRings plan_rings(const Mesh& mesh, MeshCorners& corners, std::span<const std::uint32_t> ring_sizes);

}  // namespace smurf
