// Bézier pieces of patches against the recursive definition of B-splines, and against closed forms.
#include "patches/bezier.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "harness/refusal.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using glm::dvec4;
using test::refusal;

class Uniform {
 public:
  explicit Uniform(unsigned seed) : random_(seed) {}
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }

 private:
  std::mt19937_64 random_;
};

// N_{i,p}(t) by Cox and de Boor, with 0/0 = 0.
double basis_function(const std::vector<double>& knots, int i, int p, double t) {
  const auto k = [&](int n) { return knots[std::size_t(n)]; };
  if (p == 0) return k(i) <= t && t < k(i + 1) ? 1 : 0;
  const auto part = [&](double over, double under, double value) { return under == 0 ? 0 : over / under * value; };
  return part(t - k(i), k(i + p) - k(i), basis_function(knots, i, p - 1, t)) +
         part(k(i + p + 1) - t, k(i + p + 1) - k(i + 1), basis_function(knots, i + 1, p - 1, t));
}

dvec3 by_definition(const Patch& patch, double u, double v) {
  dvec4 sum(0);
  for (int j = 0; j < patch.size[1]; j++) {
    for (int i = 0; i < patch.size[0]; i++)
      sum += basis_function(patch.knots[0], i, patch.degree[0], u) *
             basis_function(patch.knots[1], j, patch.degree[1], v) *
             patch.points[std::size_t(j) * std::size_t(patch.size[0]) + std::size_t(i)];
  }
  return dvec3(sum) / sum.w;
}

// Knots with gaps of any size, some of them several times; clamped at the ends or not.
std::vector<double> random_knots(Uniform& uniform, int degree, int size, bool clamped) {
  std::vector<double> knots{uniform(-2, 2)};
  for (int i = 1; i < size + degree + 1; i++) {
    const bool end = clamped && (i <= degree || i > size);
    const auto times = std::ranges::count(knots, knots.back());
    const bool again = uniform.below(3) == 0 && times < degree;
    knots.push_back(end || (again && i != size && i != degree + 1) ? knots.back() : knots.back() + uniform(0.1, 1.5));
  }
  return knots;
}

Patch random_patch(Uniform& uniform, int degree_u, int degree_v, bool clamped, bool rational) {
  Patch patch;
  patch.degree = {degree_u, degree_v};
  for (std::size_t d = 0; d < 2; d++) {
    patch.size[d] = patch.degree[d] + 1 + uniform.below(5);
    patch.knots[d] = random_knots(uniform, patch.degree[d], patch.size[d], clamped);
  }
  for (int i = 0; i < patch.size[0] * patch.size[1]; i++) {
    const double w = rational ? uniform(0.2, 3) : 1;
    patch.points.emplace_back(w * dvec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)), w);
  }
  return patch;
}

double size_of(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

TEST(BezierPieces, AreTheSurfaceThatBsplinesDefine) {
  Uniform uniform(1);
  for (int n = 0; n < 60; n++) {
    const Patch patch = random_patch(uniform, 1 + n % 5, 1 + uniform.below(4), n % 3 != 0, n % 2 == 0);
    require_valid(patch, "patch");
    const auto pieces = bezier_pieces(patch, 7);
    ASSERT_FALSE(pieces.empty());
    double area = 0;
    for (const BezierPiece& piece : pieces) {
      EXPECT_EQ(piece.patch, 7u);
      area += (piece.upper.x - piece.lower.x) * (piece.upper.y - piece.lower.y);
      for (int k = 0; k < 5; k++) {
        const double u = uniform(piece.lower.x, piece.upper.x), v = uniform(piece.lower.y, piece.upper.y);
        // Unclamped knots make differences of knots as small as a tenth of their range: some digits are lost.
        EXPECT_LT(size_of(evaluate(piece, u, v).position - by_definition(patch, u, v)), 1e-10) << n;
      }
    }
    const double whole = (patch.upper(0) - patch.lower(0)) * (patch.upper(1) - patch.lower(1));
    EXPECT_NEAR(area, whole, 1e-12 * whole) << n;
  }
}

TEST(BezierPieces, DerivativesAreThoseOfThePositions) {
  Uniform uniform(2);
  for (int n = 0; n < 40; n++) {
    const Patch patch = random_patch(uniform, 1 + n % most_patch_degree, 1 + uniform.below(3), true, n % 2 == 0);
    for (const BezierPiece& piece : bezier_pieces(patch, 0)) {
      const glm::dvec2 extent = piece.upper - piece.lower;
      const double u = piece.lower.x + uniform(0.1, 0.9) * extent.x, v = piece.lower.y + uniform(0.1, 0.9) * extent.y;
      const PatchPoint p = evaluate(piece, u, v);
      const double h = 1e-5 * extent.x, g = 1e-5 * extent.y;
      const auto check = [&](const dvec3& derivative, const dvec3& difference, const char* which) {
        EXPECT_LT(size_of(derivative - difference), 1e-5 * (1 + size_of(derivative))) << which << ", " << n;
      };
      const PatchPoint right = evaluate(piece, u + h, v), left = evaluate(piece, u - h, v),
                       above = evaluate(piece, u, v + g), below = evaluate(piece, u, v - g);
      check(p.u, (right.position - left.position) / (2 * h), "u");
      check(p.v, (above.position - below.position) / (2 * g), "v");
      check(p.uu, (right.u - left.u) / (2 * h), "uu");
      check(p.uv, (above.u - below.u) / (2 * g), "uv");
      check(p.vv, (above.v - below.v) / (2 * g), "vv");
    }
  }
}

TEST(BezierPieces, ShareTheirBordersToTheBit) {
  Uniform uniform(3);
  int borders = 0;
  for (int n = 0; n < 30; n++) {
    const Patch patch = random_patch(uniform, 1 + n % 4, 1 + uniform.below(3), n % 2 == 0, true);
    const auto pieces = bezier_pieces(patch, 0);
    for (const BezierPiece& a : pieces) {
      for (const BezierPiece& b : pieces) {
        if (a.upper.x != b.lower.x || a.lower.y != b.lower.y) continue;
        borders++;
        const auto columns = std::size_t(a.degree[0]) + 1;
        for (std::size_t row = 0; row * columns < a.points.size(); row++)
          EXPECT_EQ(a.points[row * columns + columns - 1], b.points[row * columns]);
      }
    }
  }
  EXPECT_GT(borders, 50);
}

// A knot that stands degree + 1 times parts the patch.
TEST(BezierPieces, AKnotMayPartThePatch) {
  Patch patch;
  patch.degree = {1, 1};
  patch.size = {4, 2};
  patch.knots = {{{0, 0, 1, 1, 2, 2}, {0, 0, 1, 1}}};
  for (const double y : {0.0, 1.0}) {
    for (const double x : {0.0, 1.0, 5.0, 6.0}) patch.points.emplace_back(x, y, 0, 1);
  }
  require_valid(patch, "patch");
  const auto pieces = bezier_pieces(patch, 0);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(evaluate(pieces[0], 1, 0.5).position, dvec3(1, 0.5, 0));
  EXPECT_EQ(evaluate(pieces[1], 1, 0.5).position, dvec3(5, 0.5, 0));
}

// A torus of radii 3 and 1 as a NURBS of degree 2 (nine points around a circle), which is exact.
TEST(BezierPieces, ATorus) {
  const double r = std::numbers::sqrt2 / 2;
  const std::array<std::array<double, 3>, 9> circle = {
      {{1, 0, 1}, {1, 1, r}, {0, 1, 1}, {-1, 1, r}, {-1, 0, 1}, {-1, -1, r}, {0, -1, 1}, {1, -1, r}, {1, 0, 1}}};
  Patch patch;
  patch.degree = {2, 2};
  patch.size = {9, 9};
  const std::vector<double> knots{0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
  patch.knots = {knots, knots};
  for (const auto& [cx, cz, cw] : circle) {
    for (const auto& [x, y, w] : circle) {
      const double around = 3 + cx;
      patch.points.emplace_back(w * cw * dvec3(around * x, around * y, cz), w * cw);
    }
  }
  require_valid(patch, "torus");
  const auto pieces = bezier_pieces(patch, 0);
  ASSERT_EQ(pieces.size(), 16u);
  Uniform uniform(4);
  for (const BezierPiece& piece : pieces) {
    for (int k = 0; k < 20; k++) {
      const PatchPoint p =
          evaluate(piece, uniform(piece.lower.x, piece.upper.x), uniform(piece.lower.y, piece.upper.y));
      const double around = std::hypot(p.position.x, p.position.y) - 3;
      EXPECT_NEAR(std::hypot(around, p.position.z), 1, 1e-14);
      // Gauss curvature cos φ / (3 + cos φ) from the fundamental forms.
      const dvec3 n = glm::normalize(glm::cross(p.u, p.v));
      const double e = glm::dot(p.u, p.u), f = glm::dot(p.u, p.v), g = glm::dot(p.v, p.v);
      const double l = glm::dot(p.uu, n), m = glm::dot(p.uv, n), o = glm::dot(p.vv, n);
      EXPECT_NEAR((l * o - m * m) / (e * g - f * f), around / (3 + around), 1e-12);
    }
  }
}

TEST(Patches, RefuseWhatIsWrong) {
  const auto said = [](const std::function<void(Patch&)>& change) {
    Patch patch = bezier_patch(1, 1, {dvec4(0, 0, 0, 1), dvec4(1, 0, 0, 1), dvec4(0, 1, 0, 1), dvec4(1, 1, 0, 1)});
    change(patch);
    return refusal(ErrorCode::input, [&] { require_valid(patch, "patch 3"); });
  };
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_TRUE(message.starts_with("patch 3: ")) << message;
  };
  expect(said([](Patch& p) { p.degree[0] = 0; }), "degree in u is 0; it must be 1 to 9");
  expect(said([](Patch& p) { p.degree[1] = 10; }), "degree in v is 10");
  expect(said([](Patch& p) { p.size[0] = 1; }), "1 control points in u; degree 1 needs at least 2");
  expect(said([](Patch& p) { p.knots[0].pop_back(); }), "3 knots in u; 2 control points of degree 1 need 4");
  expect(said([](Patch& p) { p.knots[1] = {0, 1, 0.5, 2}; }), "decrease: 0.5 stands behind 1");
  expect(said([](Patch& p) { p.knots[1][2] = NAN; }), "knot 2 in v is not finite");
  expect(said([](Patch& p) { p.knots[0] = {0, 0, 0, 1}; }), "stands more than 2 times");
  expect(said([](Patch& p) { p.knots[0] = {0, 1, 1, 2}; }), "range in u is empty");
  expect(said([](Patch& p) { p.points.pop_back(); }), "3 control points; 2 x 2 are needed");
  expect(said([](Patch& p) { p.points[2].y = INFINITY; }), "control point 2 is not finite");
  expect(said([](Patch& p) { p.points[1].w = -0.5; }), "weight of control point 1 is -0.5");
}

}  // namespace
}  // namespace smurf
