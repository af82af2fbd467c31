// What the kernels that compute normals and curvature at the vertices of a mesh read (kernels/core/mesh_parameters.inc).
#pragma once

#include <cstdint>
#include <vector>

#include "smurf/mesh.hpp"

namespace smurf {

struct MeshVertices {
  std::vector<std::uint32_t> vertices;  // with position and state
  std::vector<std::uint32_t> pairs;     // by vertex
  std::vector<std::uint32_t> rings;     // by vertex
};

// Of the mesh with its coordinates times `unit`. Throws Error (memory) when there are more words than kernels can number.
MeshVertices vertices_of(const Mesh& mesh, float unit);

}  // namespace smurf
