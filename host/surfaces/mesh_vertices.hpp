// What the kernels that compute normals and curvature at the vertices of a mesh read (kernels/core/mesh_parameters.inc).
#pragma once

#include <cstdint>

#include "smurf/mesh.hpp"
#include "smurf/values.hpp"

namespace smurf {

struct MeshVertices {
  Values<std::uint32_t> places;
  Values<std::uint32_t> rings;
};

// The power of two by which coordinates are multiplied on the device, so that the greatest is 1 to 2: products of three have room in
// floats then, and powers of two round nothing. (Coordinates below 2^-126 of the greatest may be lost.)
float mesh_unit(const Mesh& mesh);

// In lengths of 1 / `unit`. The mesh's topology is found only where a vertex has more than one fan of triangles, or they do not run through its
// edges in turn. Throws Error (memory) when there are more words than kernels can number.
MeshVertices vertices_of(const Mesh& mesh, float unit);

}  // namespace smurf
