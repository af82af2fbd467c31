#include "truth/patches.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "truth/jet2.hpp"

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

// (x, y, w) of an exact circle's control points, by arcs.
std::vector<dvec3> quarter_circles() {
  const double h = std::sqrt(0.5);
  return {{1, 0, 1}, {h, h, h}, {0, 1, 1}, {-h, h, h}, {-1, 0, 1}, {-h, -h, h}, {0, -1, 1}, {h, -h, h}, {1, 0, 1}};
}
const std::vector<double> quarter_knots{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};

// A profile (r, z, w) turned about the z axis by a circle (x, y, w).
std::vector<dvec4> turned(const std::vector<dvec3>& circle, const std::vector<dvec3>& profile) {
  std::vector<dvec4> points;
  for (const dvec3& p : profile) {
    for (const dvec3& c : circle) points.emplace_back(p.x * c.x, p.x * c.y, p.y * c.z, p.z * c.z);
  }
  return points;
}

std::vector<dvec3> tube(const std::vector<dvec3>& circle, double great, double small) {
  std::vector<dvec3> profile;
  for (const dvec3& c : circle) profile.emplace_back(great * c.z + small * c.x, small * c.y, c.z);
  return profile;
}

// Σ N_i(t) P_i and its first two derivatives, by recursion of the basis (Cox 1972; de Boor 1972).
std::vector<Jet2> basis(const std::vector<double>& knots, int degree, int size, double at, bool along_v) {
  const Jet2 t = along_v ? Jet2(at, 0, 1) : Jet2(at, 1, 0);
  std::size_t span = std::size_t(degree);
  while (span + 1 < std::size_t(size) && at >= knots[span + 1]) span++;
  while (!(knots[span] < knots[span + 1])) span--;
  std::vector<Jet2> n(knots.size(), Jet2(0));
  n[span] = 1;
  for (std::size_t p = 1; p <= std::size_t(degree); p++) {
    for (std::size_t i = span - p; i <= span; i++) {
      const double left = knots[i + p] - knots[i], right = knots[i + p + 1] - knots[i + 1];
      Jet2 sum = 0;
      if (left > 0) sum = sum + (t - knots[i]) * (1 / left) * n[i];
      if (right > 0) sum = sum + (knots[i + p + 1] - t) * (1 / right) * n[i + 1];
      n[i] = sum;
    }
  }
  n.resize(std::size_t(size));
  return n;
}

}  // namespace

Patch nurbs_torus(double great, double small) {
  const auto circle = quarter_circles();
  return {.degree = {2, 2},
          .size = {9, 9},
          .knots = {quarter_knots, quarter_knots},
          .points = turned(circle, tube(circle, great, small))};
}

std::vector<Patch> torus_of_half_circles(double great, double small) {
  const std::vector<std::vector<dvec3>> halves{{{1, 0, 1}, {0, 1, 0}, {-1, 0, 1}}, {{-1, 0, 1}, {0, -1, 0}, {1, 0, 1}}};
  std::vector<Patch> patches;
  for (const auto& across : halves) {
    for (const auto& around : halves) patches.push_back(bezier_patch(2, 2, turned(around, tube(across, great, small))));
  }
  return patches;
}

Patch nurbs_sphere(double radius) {
  const double h = std::sqrt(0.5), r = radius;
  const std::vector<dvec3> meridian{{0, -r, 1}, {h * r, -h * r, h}, {r, 0, 1}, {h * r, h * r, h}, {0, r, 1}};
  return {.degree = {2, 2},
          .size = {9, 5},
          .knots = {quarter_knots, {0, 0, 0, 1, 1, 2, 2, 2}},
          .points = turned(quarter_circles(), meridian)};
}

Patch nurbs_cylinder(double radius, double height) {
  return {.degree = {2, 1},
          .size = {9, 2},
          .knots = {quarter_knots, {0, 0, height, height}},
          .points = turned(quarter_circles(), {{radius, 0, 1}, {radius, height, 1}})};
}

Patch folded_patch() {
  // Of a cubic that rises, falls and rises.
  const std::array fold{0.0, 1.75, -0.75, 1.0};
  std::vector<dvec4> points;
  for (int j = 0; j < 4; j++) {
    for (int i = 0; i < 4; i++)
      points.emplace_back(fold[std::size_t(i)], fold[std::size_t(j)], 0.2 * i + 0.7 * j + 0.05 * ((i * j) % 2), 1);
  }
  return bezier_patch(3, 3, points);
}

std::vector<Patch> quilt(int count) {
  // One net of control points for all, so that neighbours share those of their border to the bit.
  const int across = 3 * count + 1;
  const auto net = [&](int i, int j) {
    const double x = double(i) / (across - 1), y = double(j) / (across - 1);
    return dvec4(x, y, 0.15 * std::sin(7 * x + 1) * std::cos(5 * y) + 0.05 * x * y, 1);
  };
  std::vector<Patch> patches;
  for (int b = 0; b < count; b++) {
    for (int a = 0; a < count; a++) {
      std::vector<dvec4> points;
      for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 4; i++) points.push_back(net(3 * a + i, 3 * b + j));
      }
      patches.push_back(bezier_patch(3, 3, points));
    }
  }
  return patches;
}

Patch reversed(const Patch& patch) {
  Patch result = patch;
  const auto columns = std::size_t(patch.size[0]);
  for (std::size_t row = 0; row < std::size_t(patch.size[1]); row++) {
    const auto begin = result.points.begin() + std::ptrdiff_t(row * columns);
    std::reverse(begin, begin + std::ptrdiff_t(columns));
  }
  std::vector<double>& knots = result.knots[0];
  const double sum = knots.front() + knots.back();
  std::ranges::reverse(knots);
  for (double& k : knots) k = sum - k;
  return result;
}

PatchPoint point_of(const Patch& patch, double u, double v) {
  const std::vector<Jet2> bu = basis(patch.knots[0], patch.degree[0], patch.size[0], u, false),
                          bv = basis(patch.knots[1], patch.degree[1], patch.size[1], v, true);
  std::array<Jet2, 4> sum{};
  for (std::size_t j = 0; j < bv.size(); j++) {
    for (std::size_t i = 0; i < bu.size(); i++) {
      const Jet2 weight = bu[i] * bv[j];
      for (int c = 0; c < 4; c++)
        sum[std::size_t(c)] = sum[std::size_t(c)] + weight * patch.points[j * bu.size() + i][c];
    }
  }
  PatchPoint at;
  for (int c = 0; c < 3; c++) {
    const Jet2 x = sum[std::size_t(c)] / sum[3];
    at.position[c] = x.value;
    at.u[c] = x.u, at.v[c] = x.v;
    at.uu[c] = x.uu, at.uv[c] = x.uv, at.vv[c] = x.vv;
  }
  return at;
}

dvec2 Side::place(const std::vector<Patch>& patches, double along) const {
  const Patch& p = patches[patch];
  if (backwards) along = 1 - along;
  const int fixed = side < 2 ? 0 : 1, free = 1 - fixed;
  dvec2 at;
  at[fixed] = side % 2 == 0 ? p.lower(fixed) : p.upper(fixed);
  at[free] = p.lower(free) + along * (p.upper(free) - p.lower(free));
  return at;
}

namespace {

constexpr int side_samples = 8;

std::vector<dvec3> samples_of(const std::vector<Patch>& patches, const Side& side) {
  std::vector<dvec3> samples;
  for (int i = 0; i <= side_samples; i++) {
    const dvec2 at = side.place(patches, double(i) / side_samples);
    samples.push_back(point_of(patches[side.patch], at.x, at.y).position);
  }
  return samples;
}

double apart(const std::vector<dvec3>& a, const std::vector<dvec3>& b, bool backwards) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); i++)
    worst = std::max(worst, glm::distance(a[i], b[backwards ? b.size() - 1 - i : i]));
  return worst;
}

bool is_point(const std::vector<dvec3>& samples, double gap) {
  return std::ranges::all_of(samples, [&](const dvec3& p) { return glm::distance(p, samples[0]) <= gap; });
}

}  // namespace

std::vector<SharedEdge> shared_edges(const std::vector<Patch>& patches, double gap) {
  std::vector<Side> sides;
  std::vector<std::vector<dvec3>> samples;
  for (std::size_t patch = 0; patch < patches.size(); patch++) {
    for (int side = 0; side < 4; side++) {
      std::vector<dvec3> points = samples_of(patches, {patch, side});
      if (is_point(points, gap)) continue;
      sides.push_back({patch, side});
      samples.push_back(std::move(points));
    }
  }
  std::vector<SharedEdge> edges;
  for (std::size_t i = 0; i < sides.size(); i++) {
    std::vector<SharedEdge> found;
    bool first = true;
    for (std::size_t j = 0; j < sides.size(); j++) {
      if (i == j) continue;
      for (const bool backwards : {false, true}) {
        if (apart(samples[i], samples[j], backwards) > gap) continue;
        first = first && i < j;
        Side other = sides[j];
        other.backwards = backwards;
        found.push_back({sides[i], other});
        break;
      }
    }
    if (found.size() == 1 && first) edges.push_back(found[0]);
  }
  return edges;
}

std::vector<Side> collapsed_sides(const std::vector<Patch>& patches, double gap) {
  std::vector<Side> sides;
  for (std::size_t patch = 0; patch < patches.size(); patch++) {
    for (int side = 0; side < 4; side++) {
      if (is_point(samples_of(patches, {patch, side}), gap)) sides.push_back({patch, side});
    }
  }
  return sides;
}

double extent_of(const std::vector<Patch>& patches) {
  dvec3 lower(HUGE_VAL), upper(-HUGE_VAL);
  for (const Patch& patch : patches) {
    for (const dvec4& p : patch.points) {
      if (!(p.w > 0)) continue;
      lower = glm::min(lower, dvec3(p) / p.w);
      upper = glm::max(upper, dvec3(p) / p.w);
    }
  }
  const dvec3 size = upper - lower;
  return std::max({size.x, size.y, size.z});
}

}  // namespace smurf::test
