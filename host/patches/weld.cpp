#include "patches/weld.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "patches/clusters.hpp"

namespace smurf {
namespace {

// A control point at infinity has no place: it is compared as it stands.
glm::dvec3 place(const glm::dvec4& p) { return p.w > 0 ? glm::dvec3(p) / p.w : glm::dvec3(p); }

bool same(const glm::dvec4& a, const glm::dvec4& b, double tolerance) {
  return std::abs(a.w - b.w) <= 1e-9 * std::max(a.w, b.w) && greatest_difference(place(a), place(b)) <= tolerance;
}

// Numbers of the control points of a side, in the order of the parameter along it.
std::vector<std::uint32_t> side_points(const BezierPiece& piece, int side) {
  const auto columns = std::uint32_t(piece.degree[0]) + 1, rows = std::uint32_t(piece.degree[1]) + 1;
  std::vector<std::uint32_t> points;
  if (side < 2) {
    for (std::uint32_t j = 0; j < rows; j++) points.push_back(j * columns + (side == 0 ? 0 : columns - 1));
  } else {
    for (std::uint32_t i = 0; i < columns; i++) points.push_back(i + (side == 2 ? 0 : (rows - 1) * columns));
  }
  return points;
}

}  // namespace

void weld_borders(std::vector<BezierPiece>& pieces, double tolerance) {
  std::vector<glm::dvec4*> points;  // of all pieces
  std::vector<std::uint32_t> first;
  glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper = -lower;
  for (BezierPiece& piece : pieces) {
    first.push_back(std::uint32_t(points.size()));
    for (glm::dvec4& p : piece.points) {
      points.push_back(&p);
      if (p.w <= 0) continue;
      lower = glm::min(lower, place(p));
      upper = glm::max(upper, place(p));
    }
  }
  const glm::dvec3 size = upper - lower;
  const double within = tolerance * std::max({size.x, size.y, size.z});
  if (!(within > 0) || !std::isfinite(within)) return;

  std::vector<std::vector<std::uint32_t>> sides;  // numbers of points of all pieces
  for (std::size_t n = 0; n < pieces.size(); n++) {
    for (int side = 0; side < 4; side++) {
      sides.push_back(side_points(pieces[n], side));
      for (std::uint32_t& p : sides.back()) p += first[n];
    }
  }
  std::vector<glm::dvec3> ends;
  for (const auto& side : sides) {
    ends.push_back(place(*points[side.front()]));
    ends.push_back(place(*points[side.back()]));
  }
  const std::vector<std::uint32_t> cluster = cluster_points(ends, within);
  std::map<std::array<std::uint32_t, 2>, std::vector<std::uint32_t>> by_ends;
  for (std::uint32_t s = 0; s < sides.size(); s++) {
    const auto [low, high] = std::minmax(cluster[2 * s], cluster[2 * s + 1]);
    by_ends[{low, high}].push_back(s);
  }

  DisjointSets sets(points.size());
  for (const auto& side : sides) {
    const glm::dvec4& start = *points[side[0]];
    const bool collapsed =
        start.w > 0 && std::ranges::all_of(side, [&](std::uint32_t p) {
          return points[p]->w > 0 && greatest_difference(place(*points[p]), place(start)) <= 0.1 * within;
        });
    // Weights may differ: each point keeps its own.
    if (collapsed) {
      for (const std::uint32_t p : side) *points[p] = {place(start) * points[p]->w, points[p]->w};
    }
  }
  for (const auto& [pair, numbers] : by_ends) {
    for (std::size_t a = 0; a < numbers.size(); a++) {
      for (std::size_t b = a + 1; b < numbers.size(); b++) {
        const auto &one = sides[numbers[a]], &other = sides[numbers[b]];
        if (one.size() != other.size()) continue;
        for (const bool reversed : {false, true}) {
          const auto partner = [&](std::size_t i) { return other[reversed ? other.size() - 1 - i : i]; };
          bool all = true;
          for (std::size_t i = 0; i < one.size() && all; i++) all = same(*points[one[i]], *points[partner(i)], within);
          for (std::size_t i = 0; i < one.size() && all; i++) sets.unite(one[i], partner(i));
          if (all) break;
        }
      }
    }
  }
  for (std::uint32_t p = 0; p < points.size(); p++) *points[p] = *points[sets.find(p)];
}

}  // namespace smurf
