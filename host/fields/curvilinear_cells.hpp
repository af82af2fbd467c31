// The geometry of curvilinear blocks: corner Jacobians of cells, and seams.
//
// Node (i, j, k) of a block of `size` stands at points[i + size.x*(j + size.y*k)]; cell (i, j, k) is that between nodes
// i and i+1, j and j+1, k and k+1. A span of points may be that of more blocks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace smurf {

std::size_t node_count(const glm::ivec3& size);
std::size_t cell_count(const glm::ivec3& size);
inline std::size_t node_at(const glm::ivec3& size, int i, int j, int k) {
  return std::size_t(i) + std::size_t(size.x) * (std::size_t(j) + std::size_t(size.y) * std::size_t(k));
}

// Corner a + 2b + 4c of a cell stands at node (i+a, j+b, k+c).
using CellCorners = std::array<glm::dvec3, 8>;
CellCorners corners_of(const glm::ivec3& size, std::span<const glm::dvec3> points, const glm::ivec3& cell);

// The Jacobian of the trilinear map at each corner, relative to the product of the longest edges along the three axes
// (so that it says how far edges are from lying in a plane, whatever the cell's shape and size); 0 where an edge is
// collapsed.
std::array<double, 8> corner_jacobians(const CellCorners& corners);

constexpr double vanishing_jacobian = 1e-6;  // below this a corner Jacobian counts as 0

struct CellExamination {
  int sense = 1;               // sign of most corner Jacobians: -1 in a left-handed block
  std::size_t inverted = 0;    // cells with a corner of the other sign
  std::size_t degenerate = 0;  // cells with a corner whose Jacobian vanishes
  // Per cell 1 where corner Jacobians differ in sign or vanish, so that the trilinear map may have no inverse.
  std::vector<std::uint8_t> irregular;
};
CellExamination examine_cells(const glm::ivec3& size, std::span<const glm::dvec3> points);

// Along which axes the first and last plane of nodes coincide, each node within `tolerance`. Two cells along an axis
// are too few for that.
std::array<bool, 3> find_seams(const glm::ivec3& size, std::span<const glm::dvec3> points, double tolerance);

}  // namespace smurf
