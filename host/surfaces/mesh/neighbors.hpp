// Which triangles of a mesh lie side by side.
#pragma once

#include <cstdint>
#include <vector>

#include "smurf/mesh.hpp"

namespace smurf {

// The words of kernels/mesh/layout.inc: for each side of each face what lies on its other side.
std::vector<std::uint32_t> mesh_neighbors(const Mesh& mesh);

}  // namespace smurf
