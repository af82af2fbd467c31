// What the kernels that compute normals and curvature at the vertices of a mesh read (kernels/core/mesh_parameters.inc).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "smurf/mesh.hpp"
#include "smurf/values.hpp"

namespace smurf {

// The triangles about each vertex. Throws Error (memory) when there are more words than kernels can number.
Values<std::uint32_t> corners_by_vertex(const Mesh& mesh);

// The power of two by which coordinates are multiplied on the device, so that the greatest is 1 to 2: products of three have room in
// floats then, and powers of two round nothing. (Coordinates below 2^-126 of the greatest may be lost.)
float mesh_unit(const Mesh& mesh);

// Places of the vertices, in lengths of 1 / `unit`, and the plan by which the device makes their rings, `ring_words` in all.
struct MeshRings {
  Values<std::uint32_t> places;
  Values<std::uint32_t> plan;
  std::size_t ring_words;
};

// From corners_by_vertex and, for each vertex, how many neighbours its closed fan has, or 0 (kernels/core/mesh_rings.inc). The plan has the rings that
// the device cannot make: of vertices that do not lie within the surface, or are near one that does not or that has very few or many
// neighbours. The mesh's topology is found only where a vertex has more than one fan of triangles, or they do not run through its edges in turn.
MeshRings plan_rings(const Mesh& mesh, std::span<const std::uint32_t> corners, std::span<const std::uint32_t> fan_sizes,
                     float unit);

}  // namespace smurf
