#include "fields/curvilinear_cells.hpp"

#include <algorithm>
#include <cmath>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

enum class CornerSign : int { negative = -1, none = 0, positive = 1 };

CornerSign sign_of(double jacobian) {
  if (std::abs(jacobian) <= vanishing_jacobian) return CornerSign::none;
  return jacobian < 0 ? CornerSign::negative : CornerSign::positive;
}

}  // namespace

std::size_t node_count(const glm::ivec3& size) {
  return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
}

std::size_t cell_count(const glm::ivec3& size) { return node_count(size - 1); }

CellCorners corners_of(const glm::ivec3& size, std::span<const glm::dvec3> points, const glm::ivec3& cell) {
  CellCorners corners{};
  for (int corner = 0; corner < 8; corner++)
    corners[std::size_t(corner)] =
        points[node_at(size, cell.x + (corner & 1), cell.y + (corner >> 1 & 1), cell.z + (corner >> 2))];
  return corners;
}

std::array<double, 8> corner_jacobians(const CellCorners& corners) {
  double longest[3] = {0, 0, 0};
  for (std::size_t axis = 0; axis < 3; axis++) {
    const std::size_t step = std::size_t(1) << axis;
    for (std::size_t corner = 0; corner < 8; corner++)
      if ((corner & step) == 0)
        longest[axis] = std::max(longest[axis], glm::length(corners[corner + step] - corners[corner]));
  }
  std::array<double, 8> jacobians{};
  if (longest[0] == 0 || longest[1] == 0 || longest[2] == 0) return jacobians;
  for (std::size_t corner = 0; corner < 8; corner++) {
    glm::dmat3 edges;
    for (std::size_t axis = 0; axis < 3; axis++) {
      const std::size_t step = std::size_t(1) << axis;
      edges[int(axis)] = (corners[corner | step] - corners[corner & ~step]) / longest[axis];
    }
    jacobians[corner] = glm::determinant(edges);
  }
  return jacobians;
}

CellExamination examine_cells(const glm::ivec3& size, std::span<const glm::dvec3> points) {
  // Per cell: how many corners are positive, and how many negative.
  struct Signs {
    std::uint8_t positive = 0, negative = 0;
  };
  std::vector<Signs> signs(cell_count(size));
  const std::size_t plane = std::size_t(size.x - 1) * std::size_t(size.y - 1);
  parallel_for(std::size_t(size.z - 1), [&](std::size_t k) {
    for (int j = 0; j + 1 < size.y; j++)
      for (int i = 0; i + 1 < size.x; i++) {
        Signs& cell = signs[k * plane + std::size_t(j) * std::size_t(size.x - 1) + std::size_t(i)];
        for (const double jacobian : corner_jacobians(corners_of(size, points, {i, j, int(k)}))) {
          cell.positive += sign_of(jacobian) == CornerSign::positive;
          cell.negative += sign_of(jacobian) == CornerSign::negative;
        }
      }
  });
  std::size_t positive = 0, negative = 0;
  for (const Signs& cell : signs) {
    positive += cell.positive;
    negative += cell.negative;
  }
  CellExamination found;
  found.sense = negative > positive ? -1 : 1;
  found.irregular.resize(signs.size());
  for (std::size_t cell = 0; cell < signs.size(); cell++) {
    const Signs& of = signs[cell];
    found.inverted += (found.sense > 0 ? of.negative : of.positive) > 0;
    found.degenerate += of.positive + of.negative < 8;
    found.irregular[cell] = of.positive < 8 && of.negative < 8;
  }
  return found;
}

std::array<bool, 3> find_seams(const glm::ivec3& size, std::span<const glm::dvec3> points, double tolerance) {
  std::array<bool, 3> seams{};
  for (int axis = 0; axis < 3; axis++) {
    if (size[axis] < 4) continue;
    const int across = axis == 0 ? 1 : 0, along = axis == 2 ? 1 : 2;
    bool same = true;
    glm::ivec3 node(0);
    for (node[along] = 0; same && node[along] < size[along]; node[along]++)
      for (node[across] = 0; same && node[across] < size[across]; node[across]++) {
        glm::ivec3 last = node;
        last[axis] = size[axis] - 1;
        const glm::dvec3 gap =
            points[node_at(size, node.x, node.y, node.z)] - points[node_at(size, last.x, last.y, last.z)];
        same = glm::length(gap) <= tolerance;
      }
    seams[std::size_t(axis)] = same;
  }
  return seams;
}

}  // namespace smurf
