// Normals and curvature at the vertices of a mesh, made on a device.
#pragma once

#include <cstdint>

#include "executor.hpp"
#include "smurf/mesh.hpp"

namespace smurf {

// In lengths of 1 / `unit` (mesh_unit). MESH_VERTEX_WORDS a vertex, as kernels/core/mesh_parameters.inc tells. While they are made, about 120 bytes a vertex more are taken.
TypedBuffer<std::uint32_t> make_vertices(Executor& executor, const Mesh& mesh, float unit);

}  // namespace smurf
