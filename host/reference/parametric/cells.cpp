#include "reference/parametric/cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t leaf_size = 4;

bool is_finite(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// What a row or column of three samples tells of how the surface bends there: half of the second difference, four
// times what it deviates by where the second derivative is constant, and how far the derivatives are from the
// differences, which tells more where samples are too sparse.
double bend_of(const std::array<dvec3, 3>& p, const std::array<dvec3, 3>& slopes, double step) {
  double bend = 0.5 * glm::length(p[0] - 2.0 * p[1] + p[2]);
  for (std::size_t i = 0; i < 2; i++) {
    const dvec3 difference = p[i + 1] - p[i];
    for (const dvec3& slope : {slopes[i], slopes[i + 1]}) {
      if (is_finite(slope)) bend = std::max(bend, glm::length(step * slope - difference));
    }
  }
  return std::isfinite(bend) ? bend : 0;
}

}  // namespace

ReferenceCell reference_cell(const ReferenceFacet& facet, std::uint32_t number, const dvec2& lower,
                             const dvec2& upper) {
  ReferenceCell cell;
  cell.facet = number;
  cell.lower = lower;
  cell.upper = upper;
  const dvec2 step = 0.5 * (upper - lower);
  std::array<std::array<ReferenceJet, 3>, 3> samples;
  std::array<dvec3, 9> normals;
  std::size_t normal_count = 0;
  dvec3 least(infinity), most(-infinity), mean(0.0);
  for (std::size_t j = 0; j < 3; j++) {
    for (std::size_t i = 0; i < 3; i++) {
      ReferenceJet& p = samples[j][i];
      p = facet.at(i == 2 ? upper.x : lower.x + double(i) * step.x, j == 2 ? upper.y : lower.y + double(j) * step.y, 1);
      if (!is_finite(p.s)) continue;
      cell.defined++;
      least = glm::min(least, p.s);
      most = glm::max(most, p.s);
      // Of a collapsed side there is no normal, and no need of one.
      const dvec3 normal = glm::cross(p.u, p.v);
      const double length = glm::length(normal);
      if (!(length > 1e-9 * glm::length(p.u) * glm::length(p.v))) continue;
      normals[normal_count] = normal / length;
      mean += normals[normal_count++];
    }
  }
  if (cell.defined == 0) return cell;
  cell.centre = 0.5 * (least + most);

  for (std::size_t k = 0; k < 3; k++) {
    const auto row = [&](auto member) {
      return std::array{samples[k][0].*member, samples[k][1].*member, samples[k][2].*member};
    };
    const auto column = [&](auto member) {
      return std::array{samples[0][k].*member, samples[1][k].*member, samples[2][k].*member};
    };
    const auto length = [](const std::array<dvec3, 3>& p) {
      const double all = glm::distance(p[0], p[1]) + glm::distance(p[1], p[2]);
      return std::isfinite(all) ? all : 0;
    };
    cell.bend.x = std::max(cell.bend.x, bend_of(row(&ReferenceJet::s), row(&ReferenceJet::u), step.x));
    cell.bend.y = std::max(cell.bend.y, bend_of(column(&ReferenceJet::s), column(&ReferenceJet::v), step.y));
    cell.length.x = std::max(cell.length.x, length(row(&ReferenceJet::s)));
    cell.length.y = std::max(cell.length.y, length(column(&ReferenceJet::s)));
  }

  const double total = glm::length(mean);
  cell.spread = std::numbers::pi;
  if (normal_count > 0 && total > 0.2 * double(normal_count)) {
    cell.normal = mean / total;
    double widest = 0;
    for (std::size_t i = 0; i < normal_count; i++)
      widest = std::max(widest, std::acos(std::clamp(glm::dot(cell.normal, normals[i]), -1.0, 1.0)));
    cell.spread = std::min(std::numbers::pi, 1.5 * widest + 1e-9);
  }

  const double margin = cell.bend.x + cell.bend.y;
  for (const auto& row : samples) {
    for (const ReferenceJet& p : row) {
      if (!is_finite(p.s)) continue;
      cell.radius = std::max(cell.radius, glm::distance(p.s, cell.centre));
      cell.thickness = std::max(cell.thickness, std::abs(glm::dot(cell.normal, p.s - cell.centre)));
    }
  }
  // Between samples the surface may lie as far out again as it bends.
  const double slack = 1e-12 * (glm::length(cell.centre) + cell.radius);
  cell.radius = 1.05 * cell.radius + margin + slack;
  cell.thickness += margin + slack;
  if (cell.defined < 9) {
    cell.radius *= 2;
    cell.thickness = cell.radius;
    cell.spread = std::numbers::pi;
  }
  return cell;
}

namespace {

// Cells of a facet that are nearly bilinear.
std::vector<ReferenceCell> cut(const ReferenceFacet& facet, std::uint32_t number, double extent, int start,
                               std::size_t most) {
  constexpr int deepest = 14;
  constexpr double flat = 0.1;
  struct Entry {
    ReferenceCell cell;
    int depth;
  };
  std::queue<Entry> waiting;
  std::vector<ReferenceCell> done;
  const dvec2 size = facet.upper - facet.lower;
  const auto place = [&](int i, int j) {
    return dvec2(i == start ? facet.upper.x : facet.lower.x + size.x * i / start,
                 j == start ? facet.upper.y : facet.lower.y + size.y * j / start);
  };
  for (int j = 0; j < start; j++) {
    for (int i = 0; i < start; i++) waiting.push({reference_cell(facet, number, place(i, j), place(i + 1, j + 1)), 0});
  }
  while (!waiting.empty()) {
    const auto [cell, depth] = waiting.front();
    waiting.pop();
    const double longest = std::max(cell.length.x, cell.length.y), bend = std::max(cell.bend.x, cell.bend.y);
    const bool wide = longest > 4 * std::min(cell.length.x, cell.length.y) && longest > 0.1 * extent;
    const bool curved = bend > flat * longest && longest > 1e-4 * extent;
    const bool partly = cell.defined < 9 && depth < 10;
    if (depth >= deepest || done.size() + waiting.size() >= most || (cell.defined == 0 && depth >= 4) ||
        !(partly || wide || curved)) {
      if (cell.defined > 0) done.push_back(cell);
      continue;
    }
    const bool along_u = partly ? depth % 2 == 0 : curved ? cell.bend.x > cell.bend.y : cell.length.x > cell.length.y;
    dvec2 middle_upper = cell.upper, middle_lower = cell.lower;
    const int axis = along_u ? 0 : 1;
    middle_upper[axis] = middle_lower[axis] = cell.middle()[axis];
    waiting.push({reference_cell(facet, number, cell.lower, middle_upper), depth + 1});
    waiting.push({reference_cell(facet, number, middle_lower, cell.upper), depth + 1});
  }
  return done;
}

}  // namespace

ReferenceCells::ReferenceCells(const std::vector<std::unique_ptr<ReferenceFacet>>& facets) {
  constexpr std::size_t most_cells = 400000;
  // The extent, roughly.
  dvec3 least(infinity), most(-infinity);
  for (const auto& facet : facets) {
    for (const double y : {0.0, 0.3, 0.7, 1.0}) {
      for (const double x : {0.0, 0.3, 0.7, 1.0}) {
        const dvec2 at = facet->lower + dvec2(x, y) * (facet->upper - facet->lower);
        const dvec3 s = facet->at(at.x, at.y, 0).s;
        if (!is_finite(s)) continue;
        least = glm::min(least, s);
        most = glm::max(most, s);
      }
    }
  }
  const double extent = std::max({most.x - least.x, most.y - least.y, most.z - least.z, 0.0});
  const int start = facets.size() == 1 ? 13 : 2;
  std::vector<std::vector<ReferenceCell>> found(facets.size());
  const std::size_t share = std::max<std::size_t>(most_cells / facets.size(), 16);
  parallel_for(facets.size(),
               [&](std::size_t i) { found[i] = cut(*facets[i], std::uint32_t(i), extent, start, share); });
  for (const auto& cells : found) cells_.insert(cells_.end(), cells.begin(), cells.end());
  if (!cells_.empty()) {
    build(0, std::uint32_t(cells_.size()));
  } else {
    nodes_.emplace_back();
  }
}

std::uint32_t ReferenceCells::build(std::uint32_t first, std::uint32_t count) {
  const auto begin = cells_.begin() + first, end = begin + count;
  dvec3 lower(infinity), upper(-infinity), least(infinity), most(-infinity);
  for (auto cell = begin; cell != end; ++cell) {
    lower = glm::min(lower, cell->centre - cell->radius);
    upper = glm::max(upper, cell->centre + cell->radius);
    least = glm::min(least, cell->centre);
    most = glm::max(most, cell->centre);
  }
  const auto number = std::uint32_t(nodes_.size());
  nodes_.push_back({lower, upper, first, count, 0});
  if (count <= leaf_size) return number;
  const dvec3 size = most - least;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, end,
                   [axis](const ReferenceCell& a, const ReferenceCell& b) { return a.centre[axis] < b.centre[axis]; });
  build(first, half);
  const std::uint32_t right = build(first + half, count - half);
  nodes_[number].right = right;
  nodes_[number].count = 0;
  return number;
}

void ReferenceCells::along(const dvec3& origin, const dvec3& direction, double low, double high,
                           const std::function<void(const ReferenceCell&)>& visit) const {
  if (cells_.empty()) return;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const std::uint32_t number = stack.back();
    stack.pop_back();
    const Node& node = nodes_[number];
    double enter = low, leave = high;
    for (int axis = 0; axis < 3; axis++) {
      if (direction[axis] == 0) {
        if (origin[axis] < node.lower[axis] || origin[axis] > node.upper[axis]) leave = -infinity;
        continue;
      }
      const double a = (node.lower[axis] - origin[axis]) / direction[axis];
      const double b = (node.upper[axis] - origin[axis]) / direction[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    // Cells are larger than they must be, by more than this rounds.
    if (enter > leave) continue;
    if (node.count == 0) {
      stack.push_back(node.right);
      stack.push_back(number + 1);
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; i++) visit(cells_[node.first + i]);
  }
}

void ReferenceCells::around(const dvec3& point, double reach,
                            const std::function<double(const ReferenceCell&)>& visit) const {
  if (cells_.empty()) return;
  const auto distance_to = [&](std::uint32_t number) {
    const Node& node = nodes_[number];
    return glm::length(glm::max(glm::max(node.lower - point, point - node.upper), dvec3(0.0)));
  };
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> waiting;
  waiting.push({distance_to(0), 0});
  while (!waiting.empty()) {
    const auto [distance, number] = waiting.top();
    waiting.pop();
    if (distance > reach) return;
    const Node& node = nodes_[number];
    if (node.count == 0) {
      waiting.push({distance_to(number + 1), number + 1});
      waiting.push({distance_to(node.right), node.right});
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; i++) {
      const ReferenceCell& cell = cells_[node.first + i];
      if (glm::distance(point, cell.centre) - cell.radius <= reach) reach = std::min(reach, visit(cell));
    }
  }
}

}  // namespace smurf
