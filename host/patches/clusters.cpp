#include "patches/clusters.hpp"

#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace smurf {

DisjointSets::DisjointSets(std::size_t count) : parents_(count) { std::iota(parents_.begin(), parents_.end(), 0u); }

std::uint32_t DisjointSets::find(std::uint32_t a) {
  while (parents_[a] != a) {
    parents_[a] = parents_[parents_[a]];
    a = parents_[a];
  }
  return a;
}

void DisjointSets::unite(std::uint32_t a, std::uint32_t b) {
  a = find(a);
  b = find(b);
  if (a < b) {
    parents_[b] = a;
  } else {
    parents_[a] = b;
  }
}

std::vector<std::uint32_t> cluster_points(std::span<const glm::dvec3> points, double tolerance) {
  DisjointSets sets(points.size());
  using Cell = std::array<double, 3>;
  std::map<Cell, std::vector<std::uint32_t>> cells;
  // Cells of twice the tolerance: what is near a point lies in its cell, or beyond the nearer side of it.
  const double width = 2 * tolerance;
  for (std::uint32_t i = 0; i < points.size(); i++) {
    const glm::dvec3 p = points[i];
    if (!std::isfinite(p.x + p.y + p.z)) continue;
    const glm::dvec3 low = glm::floor((p - tolerance) / width), high = glm::floor((p + tolerance) / width);
    for (double z = low.z; z <= high.z; z++) {
      for (double y = low.y; y <= high.y; y++) {
        for (double x = low.x; x <= high.x; x++) {
          const auto found = cells.find({x, y, z});
          if (found == cells.end()) continue;
          for (const std::uint32_t other : found->second) {
            if (greatest_difference(points[other], p) <= tolerance) sets.unite(i, other);
          }
        }
      }
    }
    const glm::dvec3 cell = glm::floor(p / width);
    auto& here = cells[{cell.x, cell.y, cell.z}];
    // Points that are the same to the bit need to stand there once.
    bool stands = false;
    for (const std::uint32_t other : here) stands = stands || points[other] == p;
    if (!stands) here.push_back(i);
  }
  std::vector<std::uint32_t> first(points.size());
  for (std::uint32_t i = 0; i < points.size(); i++) first[i] = sets.find(i);
  return first;
}

}  // namespace smurf
