// The hierarchy of boxes over a mesh's triangles (host/bvh/hierarchy.hpp), and the leaves that hold the triangles, laid
// out for kernels (kernels/mesh/layout.inc).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "bvh/hierarchy.hpp"
#include "smurf/mesh.hpp"

namespace smurf {

struct MeshHierarchy : Bvh {
  std::vector<std::uint32_t> triangles;  // leaf by leaf
};

// Of the mesh with its coordinates times `unit`, a power of two; with `spatial_splits` a face may stand in several
// leaves (smurf/surface.hpp). Calls `progress` with the triangles that are done and all of them, one call at a time,
// from any thread; what it throws ends the work, and leaves. Throws Error (memory) when the mesh has more triangles
// than kernels can number.
MeshHierarchy build_hierarchy(const Mesh& mesh, float unit, bool spatial_splits = false,
                              const std::function<void(std::size_t done, std::size_t total)>& progress = {});

}  // namespace smurf
