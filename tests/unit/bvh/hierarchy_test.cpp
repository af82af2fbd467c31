// The builder of hierarchies over boxes (host/bvh/hierarchy.hpp), read back word by word (kernels/bvh/layout.inc).
#include "bvh/hierarchy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <numeric>
#include <random>

#include "kernels/bvh/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using Leaves = std::vector<std::vector<std::uint32_t>>;

struct Built {
  Bvh bvh;
  Leaves leaves;
};

Built build(const std::vector<BvhBox>& boxes, const BvhOptions& options) {
  Built built;
  built.bvh = build_bvh(boxes, options, [&](std::span<const std::uint32_t> primitives) {
    built.leaves.emplace_back(primitives.begin(), primitives.end());
    return std::uint32_t(built.leaves.size() - 1);
  });
  return built;
}

bool holds(const BvhBox& outer, const BvhBox& inner) {
  return glm::all(glm::lessThanEqual(outer.lower, inner.lower)) &&
         glm::all(glm::greaterThanEqual(outer.upper, inner.upper));
}

bool meet(const BvhBox& a, const BvhBox& b) {
  return glm::all(glm::lessThanEqual(a.lower, b.upper)) && glm::all(glm::lessThanEqual(b.lower, a.upper));
}

// Goes through a hierarchy as a traversal does that meets every box.
class Reader {
 public:
  Reader(const Built& built, const std::vector<BvhBox>& boxes, const BvhOptions& options)
      : built_(built), boxes_(boxes), options_(options), times_(boxes.size()), visited_(built.leaves.size()) {}

  void read() {
    const std::vector<std::uint32_t>& nodes = built_.bvh.nodes;
    ASSERT_EQ((nodes.size() - BVH_PADDING) % BVH_NODE_WORDS, 0u);
    std::size_t read = 0;
    std::vector<Waiting> stack{{0, built_.bvh.bounds}};
    while (!stack.empty()) {
      EXPECT_LE(int(stack.size()), built_.bvh.stack);
      const Waiting next = stack.back();
      stack.pop_back();
      if (next.number < 0) {
        read_leaf(std::size_t(-1 - next.number), next.box);
        continue;
      }
      read++;
      const std::size_t at = std::size_t(next.number) * BVH_NODE_WORDS;
      ASSERT_LE(at + BVH_NODE_WORDS + BVH_PADDING, nodes.size());
      for (std::size_t i = 0; i < BVH_WIDTH; i++) {
        const auto child = std::int32_t(nodes[at + BVH_CHILDREN + i]);
        if (child == 0) continue;
        const BvhBox box = box_of_child(at, i);
        // What is split may have children beside it by the rounding of one margin.
        EXPECT_TRUE(holds(next.box, box)) << "node " << next.number << ", child " << i;
        stack.push_back({child, box});
      }
    }
    EXPECT_EQ(read * BVH_NODE_WORDS + BVH_PADDING, nodes.size()) << "every node has one parent";
    EXPECT_TRUE(std::ranges::all_of(visited_, [](int times) { return times == 1; }));
    for (std::size_t i = 0; i < times_.size(); i++) {
      EXPECT_GE(times_[i], 1) << "box " << i;
      if (!options_.split) {
        EXPECT_EQ(times_[i], 1) << "box " << i;
      }
    }
  }

  std::size_t parts() const { return std::size_t(std::accumulate(times_.begin(), times_.end(), 0)); }

 private:
  struct Waiting {
    std::int32_t number;
    BvhBox box;
  };

  BvhBox box_of_child(std::size_t at, std::size_t i) const {
    BvhBox box;
    for (std::size_t axis = 0; axis < 3; axis++) {
      box.lower[int(axis)] = std::bit_cast<float>(built_.bvh.nodes[at + axis * BVH_WIDTH + i]);
      box.upper[int(axis)] = std::bit_cast<float>(built_.bvh.nodes[at + (3 + axis) * BVH_WIDTH + i]);
    }
    return box;
  }

  void read_leaf(std::size_t number, const BvhBox& box) {
    ASSERT_LT(number, built_.leaves.size());
    visited_[number]++;
    const std::vector<std::uint32_t>& primitives = built_.leaves[number];
    EXPECT_GE(primitives.size(), 1u);
    EXPECT_LE(primitives.size(), options_.most_in_leaf);
    EXPECT_TRUE(std::ranges::is_sorted(primitives));
    for (const std::uint32_t primitive : primitives) {
      ASSERT_LT(primitive, boxes_.size());
      times_[primitive]++;
      BvhBox wide = boxes_[primitive];
      wide = {wide.lower - options_.margin, wide.upper + options_.margin};
      EXPECT_TRUE(options_.split ? meet(box, wide) : holds(box, wide)) << "box " << primitive;
    }
  }

  const Built& built_;
  const std::vector<BvhBox>& boxes_;
  const BvhOptions& options_;
  std::vector<int> times_;    // that a box stands in a leaf
  std::vector<int> visited_;  // leaves
};

Built check(const std::vector<BvhBox>& boxes, const BvhOptions& options = {}) {
  Built built = build(boxes, options);
  Reader(built, boxes, options).read();
  return built;
}

std::vector<BvhBox> random_boxes(std::size_t count, float size, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-1, 1), side(0, size);
  std::vector<BvhBox> boxes(count);
  for (BvhBox& box : boxes) {
    box.lower = {place(random), place(random), place(random)};
    box.upper = box.lower + glm::vec3(side(random), side(random), side(random));
  }
  return boxes;
}

TEST(Bvh, HoldsEveryBox) {
  for (const std::size_t count : {2u, 7u, 16u, 17u, 300u, 20'000u}) {
    SCOPED_TRACE(count);
    const std::vector<BvhBox> boxes = random_boxes(count, 0.05f);
    check(boxes);
    check(boxes, {.fewest_to_split = 16, .most_in_leaf = 32, .box_cost = 0.05f, .margin = 1e-6f});
    check(boxes, {.fewest_to_split = 1, .most_in_leaf = 1, .margin = 0.5f});
  }
}

TEST(Bvh, BoundsAreThoseOfAllBoxesWithTheMargin) {
  const std::vector<BvhBox> boxes{{{-1, 2, 3}, {0, 2.5f, 7}}, {{4, -2, 5}, {5, -1, 6}}};
  const Bvh bvh = build(boxes, {.margin = 0.25f}).bvh;
  EXPECT_EQ(bvh.bounds.lower, glm::vec3(-1.25f, -2.25f, 2.75f));
  EXPECT_EQ(bvh.bounds.upper, glm::vec3(5.25f, 2.75f, 7.25f));
}

TEST(Bvh, OneBoxHasANodeAboveItsLeaf) {
  const Built built = check({{{1, 2, 3}, {4, 5, 6}}});
  EXPECT_EQ(built.bvh.nodes.size(), std::size_t(BVH_NODE_WORDS + BVH_PADDING));
  EXPECT_EQ(built.leaves, (Leaves{{0}}));
  EXPECT_EQ(built.bvh.nodes[BVH_CHILDREN], std::uint32_t(-1));
}

// Nothing tells these apart: leaves are still no larger than asked for.
TEST(Bvh, ManyEqualBoxes) {
  check(std::vector<BvhBox>(5000, BvhBox{{1, 2, 3}, {4, 5, 6}}));
  check(std::vector<BvhBox>(5000, BvhBox{{1, 2, 3}, {4, 5, 6}}), {.fewest_to_split = 16, .most_in_leaf = 32});
  check(std::vector<BvhBox>(5000, BvhBox{{1, 2, 3}, {1, 2, 3}}), {.most_in_leaf = 1});
}

TEST(Bvh, FlatBoxes) {
  std::vector<BvhBox> boxes = random_boxes(3000, 0.1f);
  for (BvhBox& box : boxes) box.lower.z = box.upper.z = 0.5f;
  check(boxes);
  for (BvhBox& box : boxes) box.upper = box.lower;
  check(boxes, {.margin = 1e-3f});
  for (BvhBox& box : boxes) box.lower.y = box.upper.y = 3;
  check(boxes);
}

TEST(Bvh, HugeAndTinyScales) {
  for (const float scale : {1e-30f, 1e-10f, 1e10f, 1e15f}) {
    SCOPED_TRACE(scale);
    std::vector<BvhBox> boxes = random_boxes(1000, 0.1f);
    for (BvhBox& box : boxes) box = {scale * box.lower, scale * box.upper};
    check(boxes);
  }
}

TEST(Bvh, NeedsABox) { EXPECT_THROW(build({}, {}), Error); }

// Rods along a diagonal, whose boxes overlap: halves are cut off between two planes.
TEST(Bvh, SplitsBoxesThatOverlap) {
  std::vector<BvhBox> boxes;
  for (int i = 0; i < 600; i++) boxes.push_back({glm::vec3(0.001f * float(i)), glm::vec3(10 + 0.001f * float(i))});
  BvhOptions options{.fewest_to_split = 16, .most_in_leaf = 32, .box_cost = 0.05f};
  std::atomic<int> calls = 0;
  // Of a rod from a corner to the one that is opposite there is on one side of a plane what is so along all axes.
  options.split = [&](std::uint32_t primitive, const BvhBox& box, int axis, float at) {
    calls++;
    const BvhBox& whole = boxes[primitive];
    const float along = at - whole.lower[axis];
    std::array<BvhBox, 2> parts{box, box};
    parts[0].upper = glm::min(box.upper, glm::max(box.lower, whole.lower + along * 1.001f));
    parts[1].lower = glm::max(box.lower, glm::min(box.upper, whole.lower + along * 0.999f));
    parts[0].upper[axis] = parts[1].lower[axis] = at;
    return parts;
  };
  const Built built = build(boxes, options);
  Reader reader(built, boxes, options);
  reader.read();
  EXPECT_GT(calls, 0);
  EXPECT_GT(reader.parts(), 900u);
  EXPECT_LE(reader.parts(), 4 * boxes.size());
}

TEST(Bvh, TellsItsProgress) {
  const std::vector<BvhBox> boxes = random_boxes(200'000, 0.01f);
  std::size_t calls = 0, last = 0;
  std::atomic<int> inside = 0;
  BvhOptions options;
  options.progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(++inside, 1);
    EXPECT_EQ(total, boxes.size());
    EXPECT_GE(done, last);
    EXPECT_LE(done, total);
    last = done;
    calls++;
    inside--;
  };
  build(boxes, options);
  EXPECT_GT(calls, 10u);
  EXPECT_GT(last, boxes.size() / 2);
}

TEST(Bvh, WhatProgressThrowsEndsTheWork) {
  struct Enough {};
  const std::vector<BvhBox> boxes = random_boxes(200'000, 0.01f);
  std::size_t calls = 0;
  BvhOptions options;
  options.progress = [&](std::size_t, std::size_t) {
    if (++calls == 3) throw Enough();
  };
  EXPECT_THROW(build(boxes, options), Enough);
  EXPECT_EQ(calls, 3u);
  options.progress = {};
  EXPECT_FALSE(build(boxes, options).leaves.empty()) << "and the next is built";
}

TEST(Bvh, WhatALeafsWriterThrowsLeaves) {
  EXPECT_THROW(
      build_bvh(random_boxes(100, 0.1f), {},
                [](std::span<const std::uint32_t>) -> std::uint32_t { throw Error(ErrorCode::memory, "enough"); }),
      Error);
}

}  // namespace
}  // namespace smurf
