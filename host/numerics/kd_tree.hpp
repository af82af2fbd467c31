// A balanced k-d tree over points of space, in their own array (Bentley 1975): points are taken in order of their
// distance from a place.
#pragma once

#include <algorithm>
#include <cstddef>
#include <glm/glm.hpp>
#include <queue>
#include <vector>

namespace smurf {

class KdTree {
 public:
  explicit KdTree(std::vector<glm::vec3> points) : points_(std::move(points)), axes_(points_.size()) {
    build(0, points_.size());
  }
  bool empty() const { return points_.empty(); }
  std::size_t size() const { return points_.size(); }

  // visit(point, distance) in order of distance, until it returns false.
  template <class Visit>
  void nearest_first(const glm::dvec3& from, const Visit& visit) const {
    struct Entry {
      double square;  // of the distance, at least
      std::size_t first, end;
      bool point;  // else the points of a part
      bool operator<(const Entry& other) const { return square > other.square; }
    };
    std::priority_queue<Entry> queue;
    if (!empty()) queue.push({0, 0, size(), false});
    while (!queue.empty()) {
      const Entry entry = queue.top();
      queue.pop();
      if (entry.point) {
        if (!visit(points_[entry.first], std::sqrt(entry.square))) return;
        continue;
      }
      const std::size_t middle = (entry.first + entry.end) / 2;
      const glm::dvec3 offset = from - glm::dvec3(points_[middle]);
      queue.push({glm::dot(offset, offset), middle, middle + 1, true});
      const double across = offset[axes_[middle]];
      const double beyond = std::max(entry.square, across * across);
      if (middle > entry.first) queue.push({across <= 0 ? entry.square : beyond, entry.first, middle, false});
      if (middle + 1 < entry.end) queue.push({across >= 0 ? entry.square : beyond, middle + 1, entry.end, false});
    }
  }

 private:
  // The middle point of a part divides it along the axis in which it is longest.
  void build(std::size_t first, std::size_t end) {
    if (end - first < 1) return;
    glm::vec3 low = points_[first], high = low;
    for (std::size_t i = first; i < end; i++) {
      low = glm::min(low, points_[i]);
      high = glm::max(high, points_[i]);
    }
    const glm::vec3 size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (first + end) / 2;
    const auto at = [this](std::size_t i) { return points_.begin() + std::ptrdiff_t(i); };
    std::nth_element(at(first), at(middle), at(end),
                     [axis](const glm::vec3& a, const glm::vec3& b) { return a[axis] < b[axis]; });
    axes_[middle] = std::uint8_t(axis);
    build(first, middle);
    build(middle + 1, end);
  }

  std::vector<glm::vec3> points_;
  std::vector<std::uint8_t> axes_;  // by which a point divides its part
};

}  // namespace smurf
