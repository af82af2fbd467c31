// Which cells may contain a point: voxels that list the boxes that reach into them, in ascending order. Voxels with
// many cells are divided further, so that cells may be of very different size.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace smurf {

struct CellBox {
  glm::vec3 lower, upper;
};

struct VoxelTables {
  // As devices read them (kernels/flow/curvilinear_layout.inc).
  std::vector<std::uint32_t> tables, voxels, cells;
  glm::vec3 lower, upper;  // of all boxes, grown by the slack
};

// `slack`: how far outside of its box a cell may still be asked for.
VoxelTables build_voxel_tables(std::span<const CellBox> boxes, float slack);

// The cells of the voxel about a point; none outside of the box of all. For tests: devices do the same.
std::span<const std::uint32_t> cells_about(const VoxelTables& tables, const glm::vec3& point);

}  // namespace smurf
