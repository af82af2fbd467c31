// Which of many boxes contain a point: a binary tree over their centres, halved along the longest side.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <numeric>
#include <span>
#include <vector>

namespace smurf {

class BoxTree {
 public:
  struct Box {
    glm::dvec3 lower, upper;
  };

  explicit BoxTree(std::vector<Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    if (!boxes_.empty()) split(0, std::int32_t(order_.size()));
  }

  // Calls `use(number)` for the boxes that `wanted(box)` is true of, as it is of every box about such a one.
  template <class Wanted, class Use>
  void visit(const Wanted& wanted, const Use& use) const {
    if (nodes_.empty()) return;
    std::vector<std::int32_t> open{0};
    while (!open.empty()) {
      const Node& node = nodes_[std::size_t(open.back())];
      open.pop_back();
      if (!wanted(node.box)) continue;
      if (node.right > 0) {
        open.push_back(node.left);
        open.push_back(node.right);
        continue;
      }
      for (const std::int32_t i : std::span(order_).subspan(std::size_t(node.begin), std::size_t(node.count)))
        if (wanted(boxes_[std::size_t(i)])) use(i);
    }
  }

  // Numbers of the boxes that a point is in, or nearer to than `slack` along each axis, ascending.
  void find(const glm::dvec3& point, double slack, std::vector<std::int32_t>& found) const {
    found.clear();
    if (nodes_.empty()) return;
    std::vector<std::int32_t> open{0};
    while (!open.empty()) {
      const Node& node = nodes_[std::size_t(open.back())];
      open.pop_back();
      if (!contains(node.box, point, slack)) continue;
      if (node.right > 0) {
        open.push_back(node.left);
        open.push_back(node.right);
        continue;
      }
      for (const std::int32_t i : std::span(order_).subspan(std::size_t(node.begin), std::size_t(node.count)))
        if (contains(boxes_[std::size_t(i)], point, slack)) found.push_back(i);
    }
    std::ranges::sort(found);
  }

 private:
  struct Node {
    Box box;
    std::int32_t begin = 0, count = 0, left = 0, right = 0;
  };
  static constexpr std::int32_t in_leaf = 4;

  static bool contains(const Box& box, const glm::dvec3& p, double slack) {
    return glm::all(glm::greaterThanEqual(p, box.lower - slack)) && glm::all(glm::lessThanEqual(p, box.upper + slack));
  }

  // Halves are of equal number, so that the recursion is as deep as the logarithm.
  std::int32_t split(std::int32_t begin, std::int32_t end) {
    const auto items = std::span(order_).subspan(std::size_t(begin), std::size_t(end - begin));
    const auto centre = [&](std::int32_t i) { return boxes_[std::size_t(i)].lower + boxes_[std::size_t(i)].upper; };
    Node node;
    node.box = boxes_[std::size_t(items[0])];
    glm::dvec3 low = centre(items[0]), high = low;
    for (const std::int32_t i : items) {
      node.box.lower = glm::min(node.box.lower, boxes_[std::size_t(i)].lower);
      node.box.upper = glm::max(node.box.upper, boxes_[std::size_t(i)].upper);
      low = glm::min(low, centre(i));
      high = glm::max(high, centre(i));
    }
    const auto number = std::int32_t(nodes_.size());
    node.begin = begin;
    node.count = end - begin;
    nodes_.push_back(node);
    if (end - begin <= in_leaf) return number;
    const glm::dvec3 sides = high - low;
    int axis = sides.x >= sides.y ? 0 : 1;
    if (sides.z > sides[axis]) axis = 2;
    const std::int32_t middle = (begin + end) / 2;
    std::ranges::nth_element(items, items.begin() + (middle - begin),
                             [&](std::int32_t i, std::int32_t j) { return centre(i)[axis] < centre(j)[axis]; });
    const std::int32_t left = split(begin, middle), right = split(middle, end);
    nodes_[std::size_t(number)].left = left;
    nodes_[std::size_t(number)].right = right;
    return number;
  }

  std::vector<Box> boxes_;
  std::vector<std::int32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace smurf
