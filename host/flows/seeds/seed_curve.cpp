// Seed curves: polylines and natural cubic splines through points, and expressions with their exact derivatives.
//
// The spline is that of C. de Boor, A Practical Guide to Splines, 1978, IV, on knots one apart: its second derivatives
// m at the points solve m[i-1] + 4 m[i] + m[i+1] = 6 (p[i-1] - 2 p[i] + p[i+1]), m = 0 at both ends.
#include "flows/seeds/seed_curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "expression/evaluate.hpp"
#include "expression/interval.hpp"
#include "expression/parser.hpp"
#include "smurf/error.hpp"

namespace smurf {

namespace {

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void check_points(const std::vector<glm::dvec3>& points) {
  if (points.size() < 2)
    fail(fmt::format("a curve needs two points or more, and there {}",
                     points.empty() ? "are none" : "is one; a CSV file takes single seeds"));
  for (std::size_t i = 0; i < points.size(); i++) {
    if (!is_finite(points[i])) fail(fmt::format("point {} is not finite", i));
    if (i > 0 && points[i] == points[i - 1])
      fail(fmt::format("points {} and {} are the same; neighbouring points of a curve must differ", i - 1, i));
  }
}

// u as the number of a segment and the place in it, 0 to 1.
std::pair<std::size_t, double> segment_at(double u, std::size_t points) {
  const double place = std::clamp(u, 0.0, double(points - 1));
  const std::size_t segment = std::min(std::size_t(place), points - 2);
  return {segment, place - double(segment)};
}

class Polyline : public SeedCurve {
 public:
  explicit Polyline(std::vector<glm::dvec3> points) : points_(std::move(points)) { check_points(points_); }

  glm::dvec2 range() const override { return {0, double(points_.size() - 1)}; }
  SeedPoint at(double u) const override {
    const auto [i, x] = segment_at(u, points_.size());
    const glm::dvec3 along = points_[i + 1] - points_[i];
    if (x == 0) return {points_[i], i == 0 ? along : 0.5 * (points_[i + 1] - points_[i - 1])};
    if (x == 1) return {points_[i + 1], along};
    return {points_[i] + x * along, along};
  }
  double greatest_bend(double, double) const override { return 0; }
  std::vector<double> corners() const override {
    std::vector<double> found;
    for (std::size_t i = 1; i + 1 < points_.size(); i++)
      if (points_[i + 1] - points_[i] != points_[i] - points_[i - 1]) found.push_back(double(i));
    return found;
  }

 private:
  std::vector<glm::dvec3> points_;
};

class Spline : public SeedCurve {
 public:
  explicit Spline(const std::vector<glm::dvec3>& points) : points_(points), bends_(points.size(), glm::dvec3(0.0)) {
    check_points(points_);
    // Gauss elimination of the tridiagonal system; its diagonal dominates, so that no pivots are needed.
    const std::size_t last = points_.size() - 1;
    std::vector<double> above(points_.size(), 0.0);
    for (std::size_t i = 1; i < last; i++) {
      const double pivot = 4 - above[i - 1];
      above[i] = 1 / pivot;
      bends_[i] = (6.0 * (points_[i - 1] - 2.0 * points_[i] + points_[i + 1]) - bends_[i - 1]) / pivot;
    }
    for (std::size_t i = last; i-- > 1;) bends_[i] -= above[i] * bends_[i + 1];
  }

  glm::dvec2 range() const override { return {0, double(points_.size() - 1)}; }
  SeedPoint at(double u) const override {
    const auto [i, b] = segment_at(u, points_.size());
    const double a = 1 - b;
    const glm::dvec3 &m0 = bends_[i], &m1 = bends_[i + 1];
    return {a * points_[i] + b * points_[i + 1] + ((a * a * a - a) * m0 + (b * b * b - b) * m1) / 6.0,
            points_[i + 1] - points_[i] + ((1 - 3 * a * a) * m0 + (3 * b * b - 1) * m1) / 6.0, a * m0 + b * m1};
  }
  // c'' is linear between points.
  double greatest_bend(double lower, double upper) const override {
    double greatest = std::max(glm::length(at(lower).second), glm::length(at(upper).second));
    for (std::size_t i = 0; i < bends_.size(); i++) {
      if (double(i) >= lower && double(i) <= upper) greatest = std::max(greatest, glm::length(bends_[i]));
    }
    return greatest * (1 + 1e-12);
  }

 private:
  std::vector<glm::dvec3> points_;
  std::vector<glm::dvec3> bends_;  // second derivatives at the points
};

class Expressions : public SeedCurve {
 public:
  Expressions(const std::array<std::string, 3>& position, const glm::dvec2& range, const Parameters& parameters)
      : range_(range), programs_(programs_of(position, parameters)) {
    if (!std::isfinite(range.x) || !std::isfinite(range.y) || !(range.x < range.y))
      fail(fmt::format("u: the range [{}, {}] must be two finite numbers, the lesser first", range.x, range.y));
    check_extent();
  }

  glm::dvec2 range() const override { return range_; }
  SeedPoint at(double u) const override {
    const double place = std::clamp(u, range_.x, range_.y);
    std::array<double, 9> c{};
    std::vector<double> scratch;
    programs_.evaluate(std::span(&place, 1), c, scratch);
    for (std::size_t k = 0; k < 3; k++) {
      if (!std::isfinite(c[k]))
        fail(fmt::format("position[{}]: {} at u = {}", k, std::isnan(c[k]) ? "undefined" : "infinite", place));
    }
    return {{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}};
  }
  double greatest_bend(double lower, double upper) const override {
    if (programs_.has_creases) return std::numeric_limits<double>::infinity();
    constexpr int parts = 8;
    double greatest = 0;
    std::vector<expression::Interval> scratch;
    for (int i = 0; i < parts; i++) {
      const expression::Interval u{std::lerp(lower, upper, double(i) / parts),
                                   std::lerp(lower, upper, (i + 1.0) / parts)};
      std::array<expression::Interval, 3> c{};
      programs_.bends(std::span(&u, 1), c, scratch);
      double squares = 0;
      for (const expression::Interval& one : c) {
        if (!one.defined) return std::numeric_limits<double>::infinity();
        squares += std::max(one.low * one.low, one.high * one.high);
      }
      greatest = std::max(greatest, squares);
    }
    const double bend = std::sqrt(greatest) * (1 + 1e-12);
    return std::isnan(bend) ? std::numeric_limits<double>::infinity() : bend;
  }

 private:
  struct Programs {
    expression::Evaluator evaluate;       // c, c', c''
    expression::IntervalEvaluator bends;  // c''
    bool has_creases;
  };
  static Programs programs_of(const std::array<std::string, 3>& position, const Parameters& parameters) {
    using expression::derivative, expression::NodeId;
    const std::string u = "u";
    expression::Graph graph;
    std::array<NodeId, 9> roots{};  // c, c', c''
    for (std::size_t k = 0; k < 3; k++) {
      try {
        roots[k] = expression::parse(graph, position[k], std::span(&u, 1), parameters);
      } catch (const Error& error) {
        throw Error(error.code(), fmt::format("position[{}]: {}", k, error.what()));
      }
    }
    for (std::size_t k = 0; k < 6; k++) roots[k + 3] = derivative(graph, roots[k], 0);
    return {{graph, roots}, {graph, std::span(roots).subspan(6)}, expression::has_creases(graph)};
  }

  // A curve that is one point at 17 places that do not repeat is taken to be one.
  void check_extent() const {
    constexpr int places = 17;
    const glm::dvec3 begin = at(range_.x).position;
    for (int i = 1; i < places; i++) {
      const double share = (i + 0.1 * std::sin(i)) / places;
      if (at(std::lerp(range_.x, range_.y, share)).position != begin) return;
    }
    fail(fmt::format("position: the curve is the point ({}, {}, {}) all along u", begin.x, begin.y, begin.z));
  }

  glm::dvec2 range_;
  Programs programs_;
};

}  // namespace

FlowSeeds SeedCurve::sample(std::size_t count) const {
  FlowSeeds seeds;
  const glm::dvec2 ends = range();
  for (std::size_t i = 0; i < count; i++) {
    const double u = count == 1       ? 0.5 * (ends.x + ends.y)
                     : i + 1 == count ? ends.y
                                      : ends.x + (ends.y - ends.x) * double(i) / double(count - 1);
    const SeedPoint point = at(u);
    seeds.positions.push_back(point.position);
    seeds.tangents.push_back(point.first);
    seeds.second_tangents.push_back(point.second);
  }
  return seeds;
}

std::shared_ptr<const SeedCurve> polyline_seeds(std::vector<glm::dvec3> points) {
  return std::make_shared<const Polyline>(std::move(points));
}

std::shared_ptr<const SeedCurve> spline_seeds(const std::vector<glm::dvec3>& points) {
  return std::make_shared<const Spline>(points);
}

std::shared_ptr<const SeedCurve> expression_seeds(const std::array<std::string, 3>& position, const glm::dvec2& range,
                                                  const Parameters& parameters) {
  return std::make_shared<const Expressions>(position, range, parameters);
}

}  // namespace smurf
