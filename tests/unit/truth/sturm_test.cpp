// The root count that algebraic surfaces are judged by (harness/sturm.hpp), on polynomials whose roots are known
// beforehand.
#include "truth/sturm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "expression/evaluate.hpp"
#include "expression/parser.hpp"

namespace smurf::test {
namespace {

BallPolynomial times(const BallPolynomial& a, const BallPolynomial& b) {
  BallPolynomial c(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); i++)
    for (std::size_t k = 0; k < b.size(); k++) c[i + k] = c[i + k] + a[i] * b[k];
  return c;
}

BallPolynomial with_roots(const std::vector<double>& roots) {
  BallPolynomial p{1.0};
  for (const double root : roots) p = times(p, {-root, 1.0});
  return p;
}

// u² - 2·re·u + re² + im²
BallPolynomial with_complex_pair(double re, double im) {
  return {Ball(re) * Ball(re) + Ball(im) * Ball(im), -2 * re, 1.0};
}

void expect_roots(const BallPolynomial& p, std::vector<double> roots, const std::string& what,
                  double tolerance = 1e-15) {
  const DistinctRoots found = distinct_roots(p);
  EXPECT_FALSE(found.doubtful) << what;
  std::ranges::sort(roots);
  ASSERT_EQ(found.at.size(), roots.size()) << what;
  for (std::size_t i = 0; i < roots.size(); i++)
    EXPECT_NEAR(found.at[i], roots[i], tolerance) << what << ", root " << i;
}

AlgebraicSurface surface_of(const std::string& text) {
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  const expression::NodeId f = expression::parse(graph, text, variables, {});
  return AlgebraicSurface(graph, f);
}

TEST(Sturm, BallsHoldWhatTheyStandFor) {
  // Thirds have no end in binary: the ball of 1/3 · 3 - 1 must hold 0 without being it, and must not be wide.
  const Ball rest = Ball(1.0) / 3 * Ball(3.0) - Ball(1.0);
  EXPECT_EQ(rest.sign(), 0);
  EXPECT_GT(rest.radius, 0);
  EXPECT_LT(rest.radius, 1e-32);
  EXPECT_EQ((Ball(1.0) / 3 - Ball(1.0 / 3)).sign(), 1) << "a double is less than a third by 2e-17";
  EXPECT_TRUE((Ball(0.0) * rest).is_zero());
}

TEST(Sturm, KnownRoots) {
  expect_roots(with_roots({0.25}), {0.25}, "linear");
  expect_roots(with_roots({-0.5, 0.125, 0.75}), {-0.5, 0.125, 0.75}, "cubic");
  expect_roots(with_roots({-1.5, 0.5, 3}), {0.5}, "roots outside");
  expect_roots({Ball(1.0), Ball(), Ball(1.0)}, {}, "u² + 1");
  expect_roots({Ball(3.0)}, {}, "constant");
  expect_roots(times(with_roots({0.3}), {Ball(-1.0)}), {0.3}, "falling");
  // T9: cos(9 arccos u).
  BallPolynomial before{1.0}, chebyshev{Ball(), 1.0};
  std::vector<double> roots;
  for (int n = 1; n < 9; n++) {
    BallPolynomial next = times(chebyshev, {Ball(), 2.0});
    for (std::size_t i = 0; i < before.size(); i++) next[i] = next[i] - before[i];
    before = std::exchange(chebyshev, next);
  }
  for (int k = 0; k < 9; k++) roots.push_back(std::cos((k + 0.5) * std::numbers::pi / 9));
  expect_roots(chebyshev, roots, "Chebyshev");
}

TEST(Sturm, RandomRootsAmongComplexPairs) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-1.2, 1.2);
  std::size_t real = 0;
  for (int i = 0; i < 400; i++) {
    std::vector<double> roots;
    for (int k = int(random() % 6); k > 0; k--) roots.push_back(place(random));
    BallPolynomial p = with_roots(roots);
    // Pairs that come as near to the axis as 1e-5: a float cannot tell them from a double root.
    for (int k = int(random() % 3); k > 0; k--)
      p = times(p, with_complex_pair(place(random), std::pow(10.0, -double(random() % 6))));
    std::erase_if(roots, [](double r) { return std::abs(r) >= 1; });
    real += roots.size();
    expect_roots(p, roots, "case " + std::to_string(i));
  }
  EXPECT_GT(real, 500u);
}

TEST(Sturm, ClosePairsAreToldApartAndDoubleRootsAreDoubtful) {
  for (const double apart : {1e-3, 1e-6, 1e-9, 1e-11}) {
    const double first = 0.3, second = 0.3 + apart;
    expect_roots(times(with_roots({first, second, -0.7}), with_complex_pair(0.1, 0.5)), {first, second, -0.7},
                 "pair " + std::to_string(apart));
    EXPECT_TRUE(distinct_roots(times(with_roots({-0.7}), with_complex_pair(first, apart))).at.size() == 1);
  }
  // (u - 0.3)²(u + 0.7) with 0.3 as a third-like number: coefficients are rounded, so nobody can tell.
  EXPECT_TRUE(distinct_roots(with_roots({0.3, 0.3, -0.7})).doubtful);
  // An end that is a root is no place to count from.
  EXPECT_TRUE(distinct_roots(with_roots({1.0, 0.25})).doubtful);
  EXPECT_TRUE(distinct_roots({}).doubtful) << "zero all along";
}

TEST(Sturm, ExpressionsAlongRays) {
  const Domain box{glm::dvec3(-3), glm::dvec3(3), 0};
  const std::string text = "(x*y-z^3-1)^2-(1-x^2-y^2)^3+x/3-2*(y-z)";
  const AlgebraicSurface surface = surface_of(text);
  EXPECT_EQ(surface.degree(), 6);
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  const expression::NodeId f = expression::parse(graph, text, variables, {});
  const expression::Evaluator evaluator(graph, std::span(&f, 1));
  const Ray ray{{-4.25f, 0.3f, 0.7f}, {1.1f, -0.2f, 0.13f}};
  const RayPart part = part_of(box, ray, 0);
  const BallPolynomial p = surface.along(ray, part);
  ASSERT_EQ(p.size(), 7u);
  std::vector<double> scratch;
  for (int i = 0; i <= 20; i++) {
    const double u = -1 + 0.1 * i, t = 0.5 * (part.first + part.last) + 0.5 * (part.last - part.first) * u;
    const glm::dvec3 at = glm::dvec3(ray.origin) + t * glm::dvec3(ray.direction);
    double expected = 0;
    evaluator(std::span(&at.x, 3), std::span(&expected, 1), scratch);
    long double value = 0;
    for (std::size_t k = p.size(); k-- > 0;) value = value * u + static_cast<long double>(p[k].middle);
    EXPECT_NEAR(double(value), expected, 1e-11 * (1 + std::abs(expected)));
  }
  EXPECT_THROW(surface_of("sin(x)"), std::invalid_argument);
}

TEST(Sturm, PartsOfRays) {
  const Ray ray{{-5, 0.5f, 0.25f}, {2, 0, 0}};
  const Domain ball{glm::dvec3(-3), glm::dvec3(3), 1.5}, box{ball.lower, ball.upper, 0};
  const AlgebraicSurface plane = surface_of("x");
  const double half = std::sqrt(1.5 * 1.5 - 0.3125);
  EXPECT_NEAR(part_of(ball, ray, 0).first, (5 - half) / 2, 1e-15);
  EXPECT_NEAR(part_of(ball, ray, 0).last, (5 + half) / 2, 1e-15);
  EXPECT_LT(part_of(ball, ray, 0.1).first, part_of(ball, ray, 0).first);
  EXPECT_NEAR(plane.roots(ray, part_of(ball, ray, 0)).at.at(0), 2.5, 1e-15);
  EXPECT_NEAR(part_of(box, ray, 0).first, 1, 1e-15);
  EXPECT_NEAR(part_of(box, {ray.origin, ray.direction, 2.0f, 3.0f}, 0).last, 3, 1e-15);
  const RayPart beside = part_of(box, {{-5, 4, 0}, {1, 0, 0}}, 0);
  EXPECT_GT(beside.first, beside.last);
  EXPECT_TRUE(plane.roots(ray, beside).at.empty());
}

TEST(Sturm, JetsAndSingularPoints) {
  const Jet jet = surface_of("(x*y-z)^3/4-2*x^2*y").jet({1.5, -1, 0.5});
  // g = xy - z = -2 there: f = g³/4 - 2x²y, and by hand its derivatives
  EXPECT_NEAR(jet.value, -2 + 4.5, 1e-14);
  EXPECT_NEAR(glm::length(jet.gradient - glm::dvec3(3 * -1 + 6, 3 * 1.5 - 4.5, -3)), 0, 1e-14);
  EXPECT_NEAR(jet.hessian[0][0], -3 + 4, 1e-14);
  EXPECT_NEAR(jet.hessian[0][1], -3 * 1.5 * -1 + 3 - 6, 1e-14);
  EXPECT_NEAR(jet.hessian[1][1], -3 * 2.25, 1e-14);
  EXPECT_NEAR(jet.hessian[0][2], 3 * -1, 1e-14);
  EXPECT_NEAR(jet.hessian[2][2], -3, 1e-14);

  // Near a node, a crossing and a cuspidal edge: in proportion to the distance.
  for (const double d : {1e-1, 1e-3, 1e-6}) {
    EXPECT_NEAR(surface_of("x^2+y^2-z^2").distance_of_singularity({d, 0, d}) / d, std::sqrt(2 / 3.0), 1e-6);
    EXPECT_NEAR(surface_of("x*(y-1)").distance_of_singularity({0, 1 + d, 0.5}) / d, std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(surface_of("x^3-(y-1)^3").distance_of_singularity({d, 1 + d, 0.5}) / d, 0.5, 1e-6);
  }
  EXPECT_EQ(surface_of("x^2+y^2-z^2").distance_of_singularity({0, 0, 0}), 0);
  EXPECT_GT(surface_of("x^2+y^2+z^2-1").distance_of_singularity({0, 0.6, 0.8}), 0.5);
}

}  // namespace
}  // namespace smurf::test
