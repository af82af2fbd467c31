// A wide hierarchy over boxes (BVH), built by Embree (rtcBuildBVH) and laid out for kernels (kernels/bvh/layout.inc).
//
// The builder knows boxes only. The caller stores what a leaf holds, and numbers the leaves.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace smurf {

struct BvhBox {
  glm::vec3 lower{0.0f}, upper{0.0f};
};

struct BvhOptions {
  std::size_t fewest_to_split = 1;  // leaves of fewer boxes are split no further
  std::size_t most_in_leaf = 8;     // boxes; at most bvh_most_in_leaf
  float box_cost = 1.0f;            // of a test of what one box holds, in tests of a node
  float margin = 0.0f;              // boxes on the device are wider than the given ones by this, on every side

  // Spatial splits: the boxes around what `box`, the whole of number `primitive` or a part of it, holds below the
  // plane where coordinate `axis` is `at`, and above it. Called from any thread; must not throw. A primitive may then
  // stand in several leaves, in `most_parts` of them in the mean.
  std::function<std::array<BvhBox, 2>(std::uint32_t primitive, const BvhBox& box, int axis, float at)> split = {};
  std::size_t most_parts = 4;

  // Called with the boxes that are done and all of them, one call at a time, from any thread. What it throws ends the
  // work, and leaves build_bvh.
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

constexpr std::size_t bvh_most_in_leaf = 32;  // Embree builds no larger leaves

struct Bvh {
  std::vector<std::uint32_t> nodes;  // BVH_NODE_WORDS each, the first is the root; then BVH_PADDING words
  int stack = 0;                     // nodes and leaves that wait at most while a traversal goes from near to far
  BvhBox bounds;                     // of all boxes, with the margin
};

// Stores a leaf, and returns its number, below 2^31 - 1. The numbers of its boxes come in ascending order.
using BvhLeafWriter = std::function<std::uint32_t(std::span<const std::uint32_t> primitives)>;

// Over at least one box; boxes are numbered as they come. `write_leaf` is called once for each leaf when the tree is
// built, breadth first. Throws Error (memory) when kernels cannot number the nodes, or Embree cannot build them.
Bvh build_bvh(std::vector<BvhBox> boxes, const BvhOptions& options, const BvhLeafWriter& write_leaf);

}  // namespace smurf
