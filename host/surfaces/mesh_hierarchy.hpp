// The hierarchy of boxes over a mesh's triangles, built by Embree (rtcBuildBVH) and laid out for kernels (kernels/core/mesh_parameters.inc).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "smurf/mesh.hpp"

namespace smurf {

struct MeshHierarchy {
  std::vector<std::uint32_t> nodes;      // MESH_NODE_WORDS each; the first is the root
  std::vector<std::uint32_t> triangles;  // leaf by leaf
  int stack = 0;                         // words that a walk from near to far may have to keep
  glm::vec3 lower{0.0f}, upper{0.0f};    // of the root, a little wider than the mesh
};

// Calls `progress` with the part that is done. Throws Error (memory, input) when the mesh has more triangles than kernels can number.
MeshHierarchy build_hierarchy(const Mesh& mesh, const std::function<void(double)>& progress = {});

}  // namespace smurf
