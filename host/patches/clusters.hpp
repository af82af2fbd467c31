// Points that are the same within a tolerance, found by a grid in space: in time that grows with their number.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace smurf {

// Sets that are united step by step (union-find).
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count);
  std::uint32_t find(std::uint32_t a);
  void unite(std::uint32_t a, std::uint32_t b);  // the smaller number stands for both

 private:
  std::vector<std::uint32_t> parents_;
};

// For each point the first one of its cluster. Clusters are chains of points whose coordinates differ by no more than
// the tolerance, which is above 0. Points that are not finite stand alone.
std::vector<std::uint32_t> cluster_points(std::span<const glm::dvec3> points, double tolerance);

// The greatest of the differences of coordinates; not a number where one is none.
inline double greatest_difference(const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 d = glm::abs(a - b);
  const double sum = d.x + d.y + d.z;  // tells what is not a number, which comparisons do not
  return sum == sum ? glm::max(d.x, glm::max(d.y, d.z)) : sum;
}

}  // namespace smurf
