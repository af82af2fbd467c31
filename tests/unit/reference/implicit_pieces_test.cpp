// The reference of expressions where functions are undefined, jump or have creases, against closed forms and dense
// sampling.
// Nothing here needs a device.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "unit/reference/implicit_reference.hpp"

namespace smurf::reference_test {
namespace {

// --- where f is not defined, and steps ----------------------------------------------------------

TEST(ImplicitReference, PolesAndStepsAreNoRoots) {
  // A slanted ray that comes nowhere near round numbers, and one that does.
  for (const ReferenceRay& ray : {ReferenceRay{dvec3(-6, 0.1, 0.2), x_axis},
                                  ReferenceRay{dvec3(-5.93, 0.1234, 0.21), dvec3(1.0, 0.0123, -0.0314)}}) {
    const double start = ray.origin.x;
    const auto expect = [&](const std::string& text, std::vector<double> x) {
      for (double& t : x) t -= start;
      expect_roots(hits_of(text, ray, box(5)), x, 1e-9, text);
    };
    for (const std::string text :
         {"1/x", "1/(x-0.3)", "1/x^2", "1/x^3", "x/abs(x)", "floor(x)-0.5", "1/sin(x)", "1e9/x + x/3", "abs(1/x)",
          "tan(x/3.3)^2+1", "mod(x,1)+0.1", "atan2(x, -1) + 4", "exp(1/x) + 1", "1/(x^2-2) + 1/(x^2-2)^3", "x^(-3)"})
      expect(text, {});
    expect("tan(x)", {-pi, 0, pi});
    expect("1/x - 1", {1});
    expect("x - 1/x", {-1, 1});
    expect("floor(x) + x/2 - 0.25", {0.5});
    expect("mod(x, 1) - 0.5", {-4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5});
    const double root = std::sqrt(3.7 * 3.7 - 4e-6);  // one of two is next to the pole
    expect("1e-6/(x-0.3) + x - 4", {0.3 + 2e-6 / (3.7 + root), 0.3 + (3.7 + root) / 2});
    expect("atan2(x - 0.25, -1)", {});  // jumps from -pi to pi
    expect("atan2(x - 0.25, 1)", {0.25});
  }
}

TEST(ImplicitReference, WhereUndefinedThereIsNothing) {
  const ReferenceRay ray{dvec3(-3, 0.1, 0.2), x_axis};
  expect_roots(hits_of("sqrt(x) - 0.5", ray), {3.25}, 1e-12);
  expect_roots(hits_of("log(x)", ray), {4}, 1e-12);
  expect_roots(hits_of("asin(x) - 0.5", ray), {3 + std::sin(0.5)}, 1e-12);
  expect_roots(hits_of("x^0.3 - 0.7", ray), {3 + std::pow(0.7, 1 / 0.3)}, 1e-12);
  EXPECT_TRUE(hits_of("sqrt(-1 - x^2)", ray).empty());
  EXPECT_TRUE(hits_of("log(-x^2)", ray).empty());
  EXPECT_TRUE(hits_of("x*(1 + sqrt(x^2 - 1))", ray).empty());      // changes its sign over a gap
  EXPECT_TRUE(hits_of("x + 0*sqrt(abs(x) - 0.01)", ray).empty());  // and has a root in it
  expect_roots(hits_of("(x-1.5)*(x+1.5)*(1 + sqrt(x^2 - 1))", ray), {1.5, 4.5}, 1e-12);
  expect_roots(hits_of("exp(800*x) - 1", ray, box(2)), {3}, 1e-12);  // overflows
}

TEST(ImplicitReference, WildFunctionsComeToAnEnd) {
  const ReferenceRay ray{dvec3(-3, 0.1, 0.2), x_axis};
  for (const std::string text : {"sin(1/x)", "floor(1e4*x) - 0.5", "1/sin(1/x)"}) {
    const auto hits = hits_of(text, ray, {dvec3(-1), dvec3(1), 0});
    for (const ReferenceHit& hit : hits) {
      EXPECT_TRUE(hit.t >= 2 && hit.t <= 4);
      EXPECT_TRUE(hit.uncertainty >= 0 && hit.uncertainty <= 2);
    }
  }
}

// --- dense sampling -----------------------------------------------------------------------------

// Signs at points between `from` and `to`: the t around each change, and whether a pair may be missed.
std::vector<double> dense_roots(const std::function<double(dvec3)>& f, const ReferenceRay& ray, double half,
                                int points) {
  double from = ray.t_min, to = ray.t_max;
  for (int a = 0; a < 3; a++) {
    const double t0 = (-half - ray.origin[a]) / ray.direction[a], t1 = (half - ray.origin[a]) / ray.direction[a];
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  std::vector<double> found;
  double last_t = from, last = 0;
  for (int i = 0; from <= to && i <= points; i++) {
    const double t = from + (to - from) * i / points, value = f(ray.origin + t * ray.direction);
    if (last != 0 && (value < 0) != (last < 0)) found.push_back(0.5 * (t + last_t));
    last = value < 0 ? -1 : 1;
    last_t = t;
  }
  return found;
}

void expect_dense(const std::string& text, const std::function<double(dvec3)>& f, double half, int rays,
                  double least_margin, unsigned seed) {
  const FunctionRoots roots = roots_for(text, box(half));
  Uniform uniform(seed);
  const int points = 100'000;
  std::size_t total = 0;
  int left_out = 0;
  for (int i = 0; i < rays; i++) {
    const ReferenceRay ray = random_ray(uniform, half);
    const FunctionRoots::Margins margins = roots.margins(ray);
    if (std::min(margins.extremum, margins.end) < least_margin) {  // pairs may be closer together than the samples
      left_out++;
      continue;
    }
    const auto hits = hits_of(roots, ray);
    const auto dense = dense_roots(f, ray, half, points);
    ASSERT_EQ(hits.size(), dense.size()) << text << ", ray " << i << ", margin " << margins.extremum;
    for (std::size_t h = 0; h < hits.size(); h++) {
      EXPECT_EQ(hits[h].status, HitStatus::isolated);
      EXPECT_NEAR(hits[h].t * glm::length(ray.direction), dense[h] * glm::length(ray.direction), 4 * half / points);
      EXPECT_NEAR(f(ray.origin + hits[h].t * ray.direction), 0, 1e-11);
      EXPECT_GE(hits[h].margin, margins.extremum);
      EXPECT_LT(hits[h].uncertainty, 1e-8);
    }
    total += hits.size();
  }
  EXPECT_GT(total, std::size_t(rays));
  EXPECT_LE(left_out, rays / 20) << text;
}

TEST(ImplicitReference, GyroidAgreesWithDenseSampling) {
  expect_dense(
      "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)",
      [](dvec3 p) {
        return std::sin(p.x) * std::cos(p.y) + std::sin(p.y) * std::cos(p.z) + std::sin(p.z) * std::cos(p.x);
      },
      8, 200, 1e-9, 8);
}

TEST(ImplicitReference, CreasesAgreeWithDenseSampling) {
  expect_dense(
      "max(min(x^2+y^2+z^2-1, max(abs(x)-1.2, max(abs(y)-0.3, abs(z)-0.25))), 0.3-abs(sin(3*x)+y))",
      [](dvec3 p) {
        const double bar = std::max({std::abs(p.x) - 1.2, std::abs(p.y) - 0.3, std::abs(p.z) - 0.25});
        return std::max(std::min(glm::dot(p, p) - 1, bar), 0.3 - std::abs(std::sin(3 * p.x) + p.y));
      },
      1.3, 200, 1e-9, 9);
}

// --- creases ------------------------------------------------------------------------------------

TEST(ImplicitReference, Creases) {
  const ReferenceRay ray{dvec3(-3, 0.1, 0.2), x_axis};
  expect_roots(hits_of("max(x-0.5, -0.7-x)", ray), {2.3, 3.5}, 1e-12);
  expect_roots(hits_of("abs(x-0.1) - 1e-3", ray), {3.099, 3.101}, 1e-12);
  expect_roots(hits_of("abs(abs(x-0.1) - 0.3) - 0.01", ray), {2.79, 2.81, 3.39, 3.41}, 1e-12);
  // The crease is on the surface: through it, at round and other places.
  for (const double at : {0.0, 0.5, 0.3, 1 / 3.0}) {
    const std::string shifted = "(x-" + std::to_string(at) + ")";
    const double t = 3 + std::stod(std::to_string(at));
    expect_roots(hits_of("max(" + shifted + ", 2*" + shifted + ")", ray), {t}, 1e-12, shifted);
    expect_roots(hits_of("min(" + shifted + ", 1e-3*" + shifted + "^3)", ray), {t}, 1e-5, shifted);
    // And up to it.
    for (const std::string& text :
         {"abs(" + shifted + ")", "-abs(" + shifted + ")", "max(" + shifted + ", -3*" + shifted + ")"}) {
      const auto hits = hits_of(text, ray);
      ASSERT_EQ(hits.size(), 1u) << text;
      EXPECT_EQ(hits[0].status, HitStatus::tangent) << text;
      EXPECT_NEAR(hits[0].t, t, hits[0].uncertainty + 1e-15);
      EXPECT_LT(hits[0].uncertainty, 1e-7);
      EXPECT_TRUE(hits_of(text, ray, box(2), text[0] == '-' ? 1e-6 : -1e-6).empty());
      EXPECT_EQ(hits_of(text, ray, box(2), text[0] == '-' ? -1e-6 : 1e-6).size(), 2u);
    }
  }
}

TEST(ImplicitReference, UnionsAndCutsOfSpheres) {
  struct Ball {
    dvec3 centre;
    double radius;
  };
  const std::vector<Ball> balls{{{-0.5, 0.125, 0}, 0.75}, {{0.5, 0, 0.25}, 0.5}, {{0, 0.5, -0.25}, 0.625}};
  const auto text_of = [&](const std::string& operation) {
    std::string text = operation + "(";
    for (const Ball& b : balls) {
      text += (text.size() > 4 ? ", sqrt(" : "sqrt(");
      for (int a = 0; a < 3; a++)
        text += (a ? "+(" : "(") + std::string(1, "xyz"[a]) + "-(" + std::to_string(b.centre[a]) + "))^2";
      text += ")-" + std::to_string(b.radius);
    }
    return text + ")";
  };
  Uniform uniform(10);
  for (const bool cut : {false, true}) {
    const FunctionRoots roots = roots_for(text_of(cut ? "max" : "min"));
    std::vector<int> seen(7);
    for (int i = 0; i < 300; i++) {
      const ReferenceRay ray = random_ray(uniform, cut ? 0.25 : 1);
      // Ends of the spans inside balls: those that are inside none of the others, or all.
      std::vector<std::vector<double>> spans;
      double least = infinity;
      std::vector<double> ends, truth;
      for (const Ball& b : balls) {
        double margin = 0;
        spans.push_back(sphere_roots(ray, b.centre, b.radius, &margin));
        least = std::min(least, margin);
        ends.insert(ends.end(), spans.back().begin(), spans.back().end());
      }
      std::sort(ends.begin(), ends.end());
      for (std::size_t e = 1; e < ends.size(); e++) least = std::min(least, ends[e] - ends[e - 1]);
      if (least < 1e-3) continue;
      for (const double t : ends) {
        int inside = 0;
        for (const auto& span : spans) inside += !span.empty() && t > span[0] && t < span[1];
        const bool on_edge_of_all = inside == int(balls.size()) - 1;
        if (cut ? on_edge_of_all : inside == 0) truth.push_back(t);
      }
      expect_roots(hits_of(roots, ray), truth, 1e-10, (cut ? "cut, ray " : "union, ray ") + std::to_string(i));
      seen[truth.size()]++;
    }
    EXPECT_GT(seen[2], 10);
    EXPECT_GT(seen[4], cut ? -1 : 5);
  }
}

}  // namespace
}  // namespace smurf::reference_test
