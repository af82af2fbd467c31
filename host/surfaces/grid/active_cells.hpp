// The cells of a grid that can hold a root, and for every cell its distance to the nearest of them: what rays are
// traversed by (kernels/grid/traversal.inc), whatever the grid stands for.
//
// Which cells those are, the source module "cells" decides: grid_block_reaches says which blocks of 4³ cells to look
// at, and grid_block_cells which of their cells can reach the level in question.
//
// Device memory for each block of 64 cells: 8 bytes of active cells, 1 of its distance and 64 of the cells' distances,
// whose rows and slices are sums of two powers of two apart, and so up to a third longer each.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "device/executor.hpp"

namespace smurf {

class ActiveCells {
 public:
  using Texts = std::map<std::string, std::string>;

  // All that is referred to must outlive this; `uniforms` is laid out as in grid/layout.inc, and filled but for the box
  // of active cells. `bounds` is what grid_block_reaches reads.
  ActiveCells(Executor& executor, glm::ivec3 cells, const Texts& modules, const Texts& defines, DeviceBuffer& uniforms,
              DeviceBuffer& samples, DeviceBuffer& bounds);

  // The bits of the cells in each block that can hold a root of the level that stands in the uniforms now: bit
  // x + 4y + 16z of x | y << 32.
  std::vector<glm::uvec2> find();
  // Takes these cells for the active ones: computes the distances, and writes the cells' box, cut to the domain of this
  // extent, to the uniforms.
  void activate(std::span<const glm::uvec2> bits, glm::vec3 extent);

  DeviceBuffer* distances() const { return distances_.get(); }  // 16 words a block
  glm::ivec3 blocks() const { return blocks_; }
  std::size_t bytes() const { return bits_.bytes() + skips_.bytes() + distances_.bytes(); }

  std::size_t block_count() const { return std::size_t(blocks_.x) * std::size_t(blocks_.y) * std::size_t(blocks_.z); }
  static constexpr int block_cells = 4;
  // What traversals through so many cells are compiled for. `aligned` says that the world-to-index matrix is diagonal.
  static void define_traversal(Texts& defines, glm::ivec3 cells, bool aligned);
  static glm::ivec3 blocks_of(glm::ivec3 cells) {
    return glm::max((cells + block_cells - 1) / block_cells, glm::ivec3(1));
  }

 private:
  Executor& executor_;
  const Texts &modules_, &defines_;
  DeviceBuffer &uniforms_, &samples_, &bounds_;
  const glm::ivec3 blocks_;
  TypedBuffer<glm::uvec2> bits_;
  TypedBuffer<std::uint32_t> skips_;
  TypedBuffer<std::uint32_t> distances_;
};

}  // namespace smurf
