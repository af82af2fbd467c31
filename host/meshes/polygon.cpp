// Polygons in space to triangles, by cutting ears (Meisters 1975) in projection along the main axis of the area vector.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "meshes/builder.hpp"

namespace smurf {
namespace {

// Twice the signed area.
double doubled_area(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool contains(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c, const glm::dvec2& p) {
  if (p == a || p == b || p == c) return false;  // corners that the polygon passes twice
  return doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0;
}

// The corners in the plane in which the polygon runs counter-clockwise.
std::vector<glm::dvec2> flattened(const std::vector<glm::dvec3>& corners) {
  glm::dvec3 area(0.0);
  for (std::size_t i = 2; i < corners.size(); i++)
    area += glm::cross(corners[i - 1] - corners[0], corners[i] - corners[0]);
  int main = 0;
  for (int axis = 1; axis < 3; axis++) {
    if (std::abs(area[axis]) > std::abs(area[main])) main = axis;
  }
  const int x = area[main] >= 0 ? (main + 1) % 3 : (main + 2) % 3, y = 3 - main - x;
  std::vector<glm::dvec2> flat(corners.size());
  std::ranges::transform(corners, flat.begin(), [&](const glm::dvec3& p) { return glm::dvec2(p[x], p[y]); });
  return flat;
}

}  // namespace

void split_polygon(const std::vector<glm::dvec3>& corners, std::vector<glm::uvec3>& triangles) {
  triangles.clear();
  const std::vector<glm::dvec2> at = flattened(corners);
  std::vector<std::uint32_t> rest(corners.size());
  std::iota(rest.begin(), rest.end(), 0u);
  const auto is_ear = [&](std::size_t i) {
    const std::uint32_t a = rest[(i + rest.size() - 1) % rest.size()], b = rest[i], c = rest[(i + 1) % rest.size()];
    return doubled_area(at[a], at[b], at[c]) > 0 && std::ranges::none_of(rest, [&](std::uint32_t p) {
             return p != a && p != b && p != c && contains(at[a], at[b], at[c], at[p]);
           });
  };
  std::size_t candidate = 1, refused = 0;  // a convex polygon becomes the fan about its first corner
  while (rest.size() > 3 && refused < rest.size()) {
    if (!is_ear(candidate)) {
      candidate = (candidate + 1) % rest.size();
      refused++;
      continue;
    }
    triangles.emplace_back(rest[(candidate + rest.size() - 1) % rest.size()], rest[candidate],
                           rest[(candidate + 1) % rest.size()]);
    rest.erase(rest.begin() + std::ptrdiff_t(candidate));
    candidate %= rest.size();
    refused = 0;
  }
  for (std::size_t i = 2; i < rest.size(); i++) triangles.emplace_back(rest[0], rest[i - 1], rest[i]);
}

}  // namespace smurf
