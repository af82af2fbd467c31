// Sources of pieces that tests share: surfaces by expressions, and patches at random and from files.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "patches/bezier_source.hpp"
#include "patches/expression_source.hpp"

namespace smurf::test {

constexpr double turn = 2 * std::numbers::pi;

inline ExpressionSource torus() {
  return ExpressionSource({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {{0, 0}, {turn, turn}});
}
inline ExpressionSource sphere() {
  return ExpressionSource({"cos(u)*sin(v)", "sin(u)*sin(v)", "cos(v)"}, {{0, 0}, {turn, turn / 2}});
}
inline ExpressionSource cone() { return ExpressionSource({"v*cos(u)", "v*sin(u)", "v"}, {{0, 0}, {turn, 1}}); }
inline ExpressionSource klein_bottle() {
  return ExpressionSource({"(3+cos(u/2)*sin(v)-sin(u/2)*sin(2*v))*cos(u)",
                           "(3+cos(u/2)*sin(v)-sin(u/2)*sin(2*v))*sin(u)", "sin(u/2)*sin(v)+cos(u/2)*sin(2*v)"},
                          {{0, 0}, {turn, turn}});
}

class Uniform {
 public:
  explicit Uniform(unsigned seed) : random_(seed) {}
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

 private:
  std::mt19937_64 random_;
};

// One Bézier patch far from the origin, so that rounding counts.
inline BezierSource random_patch(Uniform& uniform, int degree_u, int degree_v, bool rational) {
  std::vector<glm::dvec4> points;
  for (int j = 0; j <= degree_v; j++) {
    for (int i = 0; i <= degree_u; i++) {
      const double w = rational ? uniform(0.5, 2) : 1;
      const glm::dvec3 p{100 + i + uniform(-0.4, 0.4), j + uniform(-0.4, 0.4), uniform(-1, 1)};
      points.emplace_back(w * p, w);
    }
  }
  return BezierSource(std::vector<Patch>{bezier_patch(degree_u, degree_v, points)});
}

inline double extent_of(const PieceSource& source) {
  glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper = -lower;
  for (std::size_t n = 0; n < source.size(); n++) {
    const ParameterBox range = source.range(n);
    for (int i = 0; i <= 16; i++) {
      for (int j = 0; j <= 16; j++) {
        const glm::dvec2 place = range.lower + (range.upper - range.lower) * glm::dvec2(i / 16.0, j / 16.0);
        const glm::dvec3 p = source.at(n, place.x, place.y).position;
        if (!std::isfinite(p.x + p.y + p.z)) continue;
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
      }
    }
  }
  const glm::dvec3 size = upper - lower;
  return std::max({size.x, size.y, size.z});
}

// a <= b in each component.
inline bool below(const glm::dvec3& a, const glm::dvec3& b) { return a.x <= b.x && a.y <= b.y && a.z <= b.z; }

}  // namespace smurf::test
