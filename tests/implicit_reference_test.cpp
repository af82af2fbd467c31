// The reference of surfaces given by expressions against closed forms and dense sampling. Nothing here needs a device.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "expression/parser.hpp"
#include "reference/function_roots.hpp"
#include "reference/reference_interrogation.hpp"
#include "reference_volumes.hpp"
#include "surfaces/implicit.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using reference_test::Uniform, reference_test::infinity;
using Side = ImplicitSurface::Side;

constexpr double pi = std::numbers::pi;
const dvec3 x_axis(1, 0, 0);

double greatest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

std::shared_ptr<const ImplicitFunction> function_of(const std::string& text) {
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  const expression::NodeId value = expression::parse(graph, text, variables, {});
  return differentiated(std::move(graph), value);
}

ImplicitDomain box(double half) { return {dvec3(-half), dvec3(half), 0}; }

FunctionRoots roots_for(const std::string& text, const ImplicitDomain& domain = box(2), double level = 0) {
  return FunctionRoots(function_of(text), domain, level);
}

std::vector<ReferenceHit> hits_of(const FunctionRoots& roots, const ReferenceRay& ray) {
  std::vector<ReferenceHit> hits, first;
  roots.find(ray, false, hits);
  roots.find(ray, true, first);
  EXPECT_EQ(first.empty(), hits.empty());
  if (!first.empty() && !hits.empty()) {
    EXPECT_EQ(first[0].t, hits[0].t);
    EXPECT_EQ(first[0].status, hits[0].status);
  }
  for (std::size_t i = 1; i < hits.size(); i++) EXPECT_LT(hits[i - 1].t, hits[i].t);
  return hits;
}

std::vector<ReferenceHit> hits_of(const std::string& text, const ReferenceRay& ray,
                                  const ImplicitDomain& domain = box(2), double level = 0) {
  return hits_of(roots_for(text, domain, level), ray);
}

// The hits are isolated, at these t, and enclose them.
void expect_roots(const std::vector<ReferenceHit>& hits, const std::vector<double>& t, double tolerance,
                  const std::string& where = "") {
  ASSERT_EQ(hits.size(), t.size()) << where;
  for (std::size_t i = 0; i < t.size(); i++) {
    EXPECT_EQ(hits[i].status, HitStatus::isolated) << where << ", root " << i;
    EXPECT_NEAR(hits[i].t, t[i], tolerance) << where;
    EXPECT_LE(hits[i].uncertainty, tolerance) << where;
    EXPECT_LE(std::abs(hits[i].t - t[i]), hits[i].uncertainty + 1e-15) << where << ", root " << i;
  }
}

// Through a random point of the box, from outside.
ReferenceRay random_ray(Uniform& uniform, double half) {
  const dvec3 direction = uniform(0.2, 5) * uniform.direction();
  return {uniform.vector(-half, half) - 20 * half * glm::normalize(direction), direction};
}

std::shared_ptr<const ImplicitSurface> surface_of(const std::string& text, Side side = Side::out_of_smaller,
                                                  const ImplicitDomain& domain = box(2), double level = 0) {
  return std::make_shared<const ImplicitSurface>("implicit", text, function_of(text), level, side, domain);
}

ReferencePoint measured(const ImplicitSurface& surface, const dvec3& point) {
  const auto interrogation = surface.reference();
  return dynamic_cast<const ReferenceInterrogation&>(*interrogation).surface().measure(point);
}

// --- closed forms -------------------------------------------------------------------------------

// Of a sphere, and in `distance` how far the ray's nearest point is from it.
std::vector<double> sphere_roots(const ReferenceRay& ray, const dvec3& centre, double radius, double* distance) {
  const dvec3 o = ray.origin - centre;
  const double speed2 = glm::dot(ray.direction, ray.direction), near = -glm::dot(o, ray.direction) / speed2;
  const dvec3 foot = o + near * ray.direction;
  *distance = std::abs(glm::length(foot) - radius);
  const double h2 = (radius * radius - glm::dot(foot, foot)) / speed2;
  if (h2 < 0) return {};
  return {near - std::sqrt(h2), near + std::sqrt(h2)};
}

TEST(ImplicitReference, SpheresInClosedForm) {
  // As a polynomial and as a function that is none.
  const FunctionRoots polynomial = roots_for("(x-0.3)^2 + (y+0.2)^2 + (z-0.1)^2 - 0.81");
  const FunctionRoots distance = roots_for("sqrt((x-0.3)^2 + (y+0.2)^2 + (z-0.1)^2)", box(2), 0.9);
  EXPECT_EQ(polynomial.function()->degree, 2);
  EXPECT_EQ(distance.function()->degree, -1);
  Uniform uniform(1);
  int hit = 0;
  for (int i = 0; i < 400; i++) {
    const ReferenceRay ray = random_ray(uniform, 1.5);
    double margin = 0;
    const std::vector<double> truth = sphere_roots(ray, {0.3, -0.2, 0.1}, 0.9, &margin);
    if (margin < 1e-4) continue;
    expect_roots(hits_of(polynomial, ray), truth, 1e-10, "polynomial, ray " + std::to_string(i));
    expect_roots(hits_of(distance, ray), truth, 1e-10, "distance, ray " + std::to_string(i));
    hit += !truth.empty();
  }
  EXPECT_GT(hit, 100);
}

TEST(ImplicitReference, SlopesAlternate) {
  const auto hits = hits_of("x^2 + y^2 + z^2 - 1", {dvec3(-3, 0, 0), 2.0 * x_axis});
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_NEAR(hits[0].slope, -4, 1e-12);
  EXPECT_NEAR(hits[1].slope, 4, 1e-12);
  EXPECT_GT(hits[0].margin, 0.01);  // f = -1 between them
  EXPECT_LT(hits[0].margin, 1);
  EXPECT_EQ(hits[0].margin, hits[1].margin);
}

TEST(ImplicitReference, CurvatureOfSpheres) {
  Uniform uniform(2);
  for (const Side side : {Side::out_of_smaller, Side::out_of_greater}) {
    const double sign = int(side), radius = 0.75;
    const auto surface = surface_of("x^2 + y^2 + z^2", side, box(2), radius * radius);
    for (int i = 0; i < 50; i++) {
      const dvec3 out = uniform.direction();
      const ReferencePoint p = measured(*surface, radius * out);
      EXPECT_NEAR(p.value, radius * radius, 1e-14);
      EXPECT_NEAR(glm::length(p.frame.normal - sign * out), 0, 1e-14);
      EXPECT_NEAR(p.frame.k1, sign / radius, 1e-13);
      EXPECT_NEAR(p.frame.k2, sign / radius, 1e-13);
      EXPECT_EQ(p.frame.status, PointStatus::umbilic);
    }
  }
}

TEST(ImplicitReference, TorusInBothForms) {
  const double R = 1, r = 0.4;
  const FunctionRoots quartic = roots_for("(x^2+y^2+z^2 + 1 - 0.16)^2 - 4*(x^2+y^2)");
  const FunctionRoots distance = roots_for("sqrt((sqrt(x^2+y^2) - 1)^2 + z^2) - 0.4");
  EXPECT_EQ(quartic.function()->degree, 4);
  expect_roots(hits_of(quartic, {dvec3(-3, 0, 0), x_axis}), {3 - R - r, 3 - R + r, 3 + R - r, 3 + R + r}, 1e-12);
  expect_roots(hits_of(distance, {dvec3(-3, 0, 0), x_axis}), {3 - R - r, 3 - R + r, 3 + R - r, 3 + R + r}, 1e-12);
  EXPECT_TRUE(hits_of(distance, {dvec3(0, 0, -3), dvec3(0, 0, 1)}).empty());  // through the hole
  Uniform uniform(3);
  std::size_t most = 0;
  for (int i = 0; i < 200; i++) {
    const ReferenceRay ray = random_ray(uniform, 1);
    if (quartic.margins(ray).extremum < 1e-6) continue;
    const auto hits = hits_of(quartic, ray);
    std::vector<double> t;
    for (const ReferenceHit& hit : hits) {
      t.push_back(hit.t);
      const dvec3 x = ray.origin + hit.t * ray.direction;
      EXPECT_NEAR(std::hypot(std::hypot(x.x, x.y) - R, x.z), r, 1e-12);
    }
    const auto others = hits_of(distance, ray);
    ASSERT_EQ(others.size(), hits.size()) << i;
    for (std::size_t h = 0; h < hits.size(); h++) EXPECT_NEAR(others[h].t, t[h], 1e-10);
    most = std::max(most, hits.size());
  }
  EXPECT_EQ(most, 4u);

  for (const std::string text : {"(x^2+y^2+z^2 + 1 - 0.16)^2 - 4*(x^2+y^2)", "(sqrt(x^2+y^2) - 1)^2 + z^2 - 0.16"}) {
    const auto surface = surface_of(text);
    for (int i = 0; i < 20; i++) {
      const double theta = uniform(-pi, pi), phi = uniform(-pi, pi), c = std::cos(phi);
      const dvec3 ring(std::cos(theta), std::sin(theta), 0);
      const dvec3 out = c * ring + dvec3(0, 0, std::sin(phi));
      const SurfaceFrame frame = measured(*surface, R * ring + r * out).frame;
      EXPECT_NEAR(glm::length(frame.normal - out), 0, 1e-12);
      EXPECT_NEAR(frame.k1, 1 / r, 1e-11);
      EXPECT_NEAR(frame.k2, c / (R + r * c), 1e-11);
      EXPECT_NEAR(std::abs(glm::dot(frame.d2, dvec3(-ring.y, ring.x, 0))), 1, 1e-10);
    }
  }
}

TEST(ImplicitReference, CurvatureOfGraphs) {
  // z = k x y², where all second derivatives of x and y differ from zero, and with z in a product.
  const auto surface = surface_of("exp(0.3*z) * (z - 0.7*x*y^2)");
  Uniform uniform(4);
  for (int i = 0; i < 50; i++) {
    const double k = 0.7, x = uniform(-1, 1), y = uniform(-1, 1);
    const double fx = k * y * y, fy = 2 * k * x * y, fxy = 2 * k * y, fyy = 2 * k * x, w2 = 1 + fx * fx + fy * fy;
    const SurfaceFrame frame = measured(*surface, {x, y, k * x * y * y}).frame;
    EXPECT_NEAR(frame.k1 * frame.k2, -fxy * fxy / (w2 * w2), 1e-12);
    // Bending away from the normal is positive here: the negative of z's second derivatives.
    EXPECT_NEAR(frame.k1 + frame.k2, -((1 + fx * fx) * fyy - 2 * fx * fy * fxy) / std::pow(w2, 1.5), 1e-12);
    EXPECT_NEAR(glm::length(frame.normal - dvec3(-fx, -fy, 1) / std::sqrt(w2)), 0, 1e-13);
  }
}

TEST(ImplicitReference, TanglecubeAlongAxes) {
  const FunctionRoots roots = roots_for("x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", box(3));
  Uniform uniform(5);
  std::vector<int> seen(5);
  for (int i = 0; i < 300; i++) {
    const int axis = i % 3;
    dvec3 origin = uniform.vector(-2.5, 2.5), direction(0.0);
    origin[axis] = -4;
    direction[axis] = 1;
    double c = 11.8;
    for (int a = 0; a < 3; a++) {
      if (a != axis) c += std::pow(origin[a], 4) - 5 * std::pow(origin[a], 2);
    }
    const double d = 25 - 4 * c;
    if (std::abs(d) < 1e-3 || std::abs(c) < 1e-3) continue;
    std::vector<double> truth;
    for (const double square : {(5 + std::sqrt(d)) / 2, (5 - std::sqrt(d)) / 2}) {
      if (!(square > 0)) continue;  // nor where d < 0
      for (const double x : {std::sqrt(square), -std::sqrt(square)}) {
        if (std::abs(x) < 3) truth.push_back(x + 4);
      }
    }
    std::sort(truth.begin(), truth.end());
    expect_roots(hits_of(roots, {origin, direction}), truth, 1e-10, "ray " + std::to_string(i));
    seen[truth.size()]++;
  }
  EXPECT_GT(seen[0], 10);
  EXPECT_GT(seen[2], 10);
  EXPECT_GT(seen[4], 10);
}

TEST(ImplicitReference, ProductsOfPlanes) {
  Uniform uniform(6);
  for (const int degree : {1, 3, 8, 16, 17, 25, 40, 60, 70}) {  // 70 is not taken up as a polynomial
    for (int repeat = 0; repeat < 4; repeat++) {
      std::vector<double> at;
      std::string text;
      for (int i = 0; i < degree; i++) {
        // One in each part of [-1, 1], and some of them close to the next.
        const double a = -1 + 2 * (i + uniform(repeat < 2 ? 0.1 : 0, 1)) / degree;
        at.push_back(a);
        text += (i > 0 ? "*(x-(" : "(x-(") + std::to_string(a) + "))";
        at.back() = std::stod(std::to_string(a));
      }
      double least = infinity;
      for (int i = 1; i < degree; i++) least = std::min(least, at[i] - at[i - 1]);
      if (least < 1e-4) continue;
      const ReferenceRay ray{dvec3(-3, 0.1, -0.3), dvec3(2, uniform(-0.3, 0.3), uniform(-0.3, 0.3))};
      const FunctionRoots roots = roots_for(text, box(1.25));
      EXPECT_EQ(roots.function()->degree, degree);
      std::vector<double> truth;
      for (const double a : at) truth.push_back((a + 3) / 2);
      expect_roots(hits_of(roots, ray), truth, 1e-12, "degree " + std::to_string(degree));
    }
  }
}

TEST(ImplicitReference, HighPowersAreNotLostInTheirRange) {
  // Values from 1e-35 to 1e14 in the domain.
  expect_roots(hits_of("(x^2+y^2+z^2)^30 - 1e-9", {dvec3(-3, 0, 0), x_axis}),
               {3 - std::pow(1e-9, 1 / 60.0), 3 + std::pow(1e-9, 1 / 60.0)}, 1e-11);
  expect_roots(hits_of("(x^2+y^2+z^2)^40 - 1e-9", {dvec3(-3, 0, 0), x_axis}),
               {3 - std::pow(1e-9, 1 / 80.0), 3 + std::pow(1e-9, 1 / 80.0)}, 1e-11);
}

// --- multiple roots -----------------------------------------------------------------------------

TEST(ImplicitReference, DoubleRootsAreTangent) {
  for (const std::string text : {"(x-0.3)^2*(x+1.1)", "(x-0.3)^2*exp(x+y)*(x+1.1)", "(sin(x-0.3))^2*(x+1.1)"}) {
    const auto hits = hits_of(text, {dvec3(-3, 0.1, 0.2), x_axis});
    ASSERT_EQ(hits.size(), 2u) << text;
    EXPECT_EQ(hits[0].status, HitStatus::isolated);
    EXPECT_NEAR(hits[0].t, 1.9, 1e-12);
    EXPECT_EQ(hits[1].status, HitStatus::tangent);
    EXPECT_NEAR(hits[1].t, 3.3, hits[1].uncertainty);
    EXPECT_LT(hits[1].uncertainty, 1e-4);
    EXPECT_LT(roots_for(text).margins({dvec3(-3, 0.1, 0.2), x_axis}).extremum, 1e-14);
  }
  // Touching a sphere, on its side.
  Uniform uniform(7);
  for (int i = 0; i < 50; i++) {
    const dvec3 normal = uniform.direction(), along = glm::normalize(glm::cross(normal, uniform.direction()));
    const auto hits = hits_of("x^2 + y^2 + z^2 - 1", {normal - 5.0 * along, along});
    ASSERT_EQ(hits.size(), 1u);
    EXPECT_EQ(hits[0].status, HitStatus::tangent);
    EXPECT_NEAR(hits[0].t, 5, hits[0].uncertainty);
  }
}

TEST(ImplicitReference, PairsOfRootsAreToldApartOrTangent) {
  for (const std::string text : {"(x-0.3)^2 + 0*y", "(x-0.3)^2 + 0*exp(y)", "2 - 2*cos(x-0.3)"}) {
    for (const double shift : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8}) {
      const ReferenceRay ray{dvec3(-3, 0.1, 0.2), x_axis};
      const auto two = hits_of(text, ray, box(2), shift * shift), none = hits_of(text, ray, box(2), -shift * shift);
      if (shift > 5e-5) {
        ASSERT_EQ(two.size(), 2u) << text << " " << shift;
        EXPECT_EQ(two[0].status, HitStatus::isolated);
        EXPECT_NEAR(two[0].t, 3.3 - shift, std::max(1e-12, 0.05 * shift * shift));
        EXPECT_NEAR(two[1].t, 3.3 + shift, std::max(1e-12, 0.05 * shift * shift));
        EXPECT_TRUE(none.empty());
      }
      // All roots are enclosed, whatever the status.
      for (const double root : {3.3 - shift, 3.3 + shift}) {
        bool enclosed = false;
        for (const ReferenceHit& hit : two) enclosed |= std::abs(hit.t - root) <= hit.uncertainty + shift * shift;
        EXPECT_TRUE(enclosed) << text << " " << shift;
      }
      for (const auto& hits : {two, none}) {
        EXPECT_TRUE(hits.size() != 1 || hits[0].status == HitStatus::tangent) << text << " " << shift;
      }
    }
  }
}

TEST(ImplicitReference, TripleRootsAreIsolatedAndUncertain) {
  for (const std::string text : {"(x-0.3)^3", "(x-0.3)^5", "(x-0.3)^3*exp(y)", "sin(x-0.3)^3", "(x-0.25)^3", "x^3"}) {
    const auto hits = hits_of(text, {dvec3(-3, 0.1, 0.2), x_axis});
    ASSERT_EQ(hits.size(), 1u) << text;
    EXPECT_EQ(hits[0].status, HitStatus::isolated) << text;
    const double truth = text == "x^3" ? 3 : text == "(x-0.25)^3" ? 3.25 : 3.3;
    EXPECT_NEAR(hits[0].t, truth, hits[0].uncertainty) << text;
    EXPECT_LT(hits[0].uncertainty, 1e-2) << text;
  }
  // Coarse pieces next to it do not count it once more.
  expect_roots(hits_of("(x-0.3)^11*(x-0.5)^11*(x-0.9)", {dvec3(-3, 0.1, 0.2), x_axis}), {3.3, 3.5, 3.9}, 1e-2);
  EXPECT_EQ(hits_of("(x-0.3)^12", {dvec3(-3, 0.1, 0.2), x_axis}).size(), 1u);
  // Written out, it is known no better than to the cube root of the rounding.
  const auto hits = hits_of("x^3 - 0.9*x^2 + 0.27*x - 0.027", {dvec3(-3, 0.1, 0.2), x_axis});
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_NEAR(hits[0].t, 3.3, hits[0].uncertainty);
  EXPECT_LT(hits[0].uncertainty, 1e-3);
}

TEST(ImplicitReference, RaysInTheSurfaceAreOneUnresolvedPlateau) {
  for (const std::string text : {"x-0.5", "sin(x-0.5)", "max(x-0.5, -1)", "(x-0.5)*(y^2+1)"}) {
    const auto hits = hits_of(text, {dvec3(0.5, -5, 0.3), dvec3(0, 2, 0)});
    ASSERT_EQ(hits.size(), 1u) << text;
    EXPECT_EQ(hits[0].status, HitStatus::unresolved);
    EXPECT_NEAR(hits[0].t, 2.5, 1e-6);
    EXPECT_NEAR(hits[0].uncertainty, 1, 1e-6);
  }
  // A flat part of a crease.
  const auto hits = hits_of("max(abs(x) - 0.5, 0)", {dvec3(-3, 0, 0.3), x_axis});
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].status, HitStatus::unresolved);
  EXPECT_NEAR(hits[0].t, 3, 1e-6);
  EXPECT_NEAR(hits[0].uncertainty, 0.5, 1e-6);
  // Everywhere, and nowhere.
  EXPECT_EQ(hits_of("0*x", {dvec3(-3, 0, 0.3), x_axis}).size(), 1u);
  EXPECT_EQ(hits_of("0*x", {dvec3(-3, 0, 0.3), x_axis}, box(2), 1e-300).size(), 0u);
}

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

// --- ranges and domains -------------------------------------------------------------------------

TEST(ImplicitReference, RangesAndRaysFromInside) {
  for (const std::string text : {"x^2 + y^2 + z^2 - 1", "sqrt(x^2 + y^2 + z^2) - 1"}) {
    const FunctionRoots roots = roots_for(text);
    const auto range = [&](double from, double to, double start = 0) {
      return hits_of(roots, {dvec3(start, 0, 0), x_axis, from, to});
    };
    expect_roots(range(0, infinity), {1}, 1e-12);         // from the centre
    expect_roots(range(0, infinity, 0.9), {0.1}, 1e-12);  // from inside
    expect_roots(range(-10, 10), {-1, 1}, 1e-12);         // backwards, too
    expect_roots(range(-10, 0), {-1}, 1e-12);
    expect_roots(range(0, 1.0001), {1}, 1e-12);
    EXPECT_TRUE(range(0, 0.9999).empty());
    EXPECT_TRUE(range(1.0001, infinity).empty());
    EXPECT_TRUE(range(0, infinity, 3).empty());  // behind it
    EXPECT_TRUE(range(0, infinity, 1.5).empty());
    EXPECT_TRUE(range(0.5, 0.5).empty());
    expect_roots(range(0.99999999, 1.00000001), {1}, 1e-12);
    // Beginning or ending on it.
    for (const auto& hits : {range(1, infinity), range(0, 1), range(0, infinity, 1), range(1, 1)}) {
      ASSERT_EQ(hits.size(), 1u);
      EXPECT_EQ(hits[0].status, HitStatus::unresolved);
    }
  }
}

TEST(ImplicitReference, FarOriginsAndLengthsOfDirections) {
  for (const std::string text : {"x^2 + y^2 + z^2 - 0.49", "sqrt(x^2 + y^2 + z^2) - 0.7"}) {
    for (const double scale : {1e-30, 1e-6, 1e6, 1e30}) {
      const auto hits = hits_of(text, {dvec3(-3, 0.1, 0.2), scale * x_axis});
      ASSERT_EQ(hits.size(), 2u);
      EXPECT_NEAR(hits[0].t * scale, 3 - std::sqrt(0.44), 1e-12);
      EXPECT_NEAR(hits[1].t * scale, 3 + std::sqrt(0.44), 1e-12);
    }
    for (const double far : {1e4, 1e8, 1e12}) {
      const auto hits = hits_of(text, {dvec3(-far, 0.1, 0.2), x_axis});
      ASSERT_EQ(hits.size(), 2u);
      for (const int h : {0, 1}) {
        EXPECT_EQ(hits[h].status, HitStatus::isolated);
        EXPECT_NEAR(hits[h].t - far, (2 * h - 1) * std::sqrt(0.44), 1e-15 * far);
        EXPECT_LT(hits[h].uncertainty, 1e-15 * far + 1e-12);
      }
    }
  }
  // Small and large worlds.
  for (const double size : {1e-12, 1e-3, 1e3, 1e12}) {
    const auto hits =
        hits_of("x^2 + y^2 + z^2", {dvec3(-3, 0.1, 0.2) * size, x_axis}, box(2 * size), 0.49 * size * size);
    ASSERT_EQ(hits.size(), 2u);
    EXPECT_NEAR(hits[0].t / size, 3 - std::sqrt(0.44), 1e-12);
  }
}

TEST(ImplicitReference, TheBox) {
  const ImplicitDomain domain{dvec3(-1, -2, 0), dvec3(3, 1, 0.5), 0};
  expect_roots(hits_of("sin(pi*x)", {dvec3(-5.25, 0, 0.25), x_axis}, {dvec3(-0.5, -2, 0), dvec3(2.5, 1, 0.5), 0}),
               {5.25, 6.25, 7.25}, 1e-12);
  EXPECT_TRUE(hits_of("x", {dvec3(-5, 1.001, 0.25), x_axis}, domain).empty());  // beside it
  EXPECT_TRUE(hits_of("x", {dvec3(-5, 0, -0.001), x_axis}, domain).empty());
  expect_roots(hits_of("x", {dvec3(-5, 1, 0.5), x_axis}, domain), {5}, 1e-12);  // in an edge
  expect_roots(hits_of("x", {dvec3(-5, 0, 0), dvec3(1, 1e-18, 0)}, domain), {5}, 1e-12);
  EXPECT_TRUE(hits_of("x-3.001", {dvec3(-5, 0, 0.25), x_axis}, domain).empty());
  // No thickness.
  const ImplicitDomain sheet{dvec3(-1, -1, 0), dvec3(1, 1, 0), 0};
  expect_roots(hits_of("x^2+z-0.25", {dvec3(-2, 0.1, 0), x_axis}, sheet), {1.5, 2.5}, 1e-12);
  EXPECT_TRUE(hits_of("x^2+z-0.25", {dvec3(0, 0, -1), dvec3(0, 0, 1)}, sheet).empty());
  EXPECT_EQ(hits_of("x^2+z-0.25", {dvec3(0.5, 0, -1), dvec3(0, 0, 1)}, sheet).size(), 1u);
}

TEST(ImplicitReference, TheBall) {
  ImplicitDomain domain = box(1);
  domain.radius = 1.25;  // cuts off the corners
  Uniform uniform(11);
  int in = 0, cut_off = 0;
  for (const std::string text : {"x + 2*y - 3*z - 0.25", "sinh(x + 2*y - 3*z - 0.25)"}) {
    const FunctionRoots roots = roots_for(text, domain);
    for (int i = 0; i < 500; i++) {
      const ReferenceRay ray = random_ray(uniform, 1);
      const dvec3 normal(1, 2, -3);
      const double t = (0.25 - glm::dot(normal, ray.origin)) / glm::dot(normal, ray.direction);
      const dvec3 at = ray.origin + t * ray.direction;
      const double beyond = std::max(glm::length(at) - 1.25, greatest(at) - 1);
      if (std::abs(beyond) < 1e-4) continue;
      const auto hits = hits_of(roots, ray);
      ASSERT_EQ(hits.size(), beyond < 0 ? 1u : 0u) << i;
      for (const ReferenceHit& hit : hits) EXPECT_NEAR(hit.t, t, 1e-10);
      in += beyond < 0;
      cut_off += beyond > 0 && greatest(at) < 1;
    }
  }
  EXPECT_GT(in, 100);
  EXPECT_GT(cut_off, 5);
  EXPECT_TRUE(hits_of("x", {dvec3(-3, 0.95, 0.95), x_axis}, domain).empty());  // misses the ball
  expect_roots(hits_of("x", {dvec3(-1e8, 0.1, 0.95), x_axis}, domain), {1e8}, 1e-6);
  expect_roots(hits_of("x", {dvec3(0, 0, 0), x_axis, -1, 5}, domain), {0}, 1e-12);
}

// --- points -------------------------------------------------------------------------------------

TEST(ImplicitReference, PointsOutsideOrUndefined) {
  ImplicitDomain domain = box(1);
  domain.radius = 1.25;
  const auto defined = [&](const std::string& text, const dvec3& point, bool value, bool frame) {
    const ReferencePoint p = measured(*surface_of(text, Side::out_of_smaller, domain), point);
    EXPECT_EQ(std::isfinite(p.value), value) << text;
    EXPECT_EQ(p.frame.status != PointStatus::undefined, frame) << text;
    EXPECT_EQ(std::isfinite(p.frame.k1), frame) << text;
  };
  const std::string sphere = "x^2+y^2+z^2-0.5";
  defined(sphere, {0.5, 0.2, 0.1}, true, true);
  defined(sphere, {1, 0, 0}, true, true);
  defined(sphere, {1 + 1e-10, 0, 0}, true, true);
  defined(sphere, {double(float(1)) + 1e-7, 0, 0}, true, true);  // as floats round
  defined(sphere, {1.00001, 0, 0}, false, false);
  defined(sphere, {0.9, 0.9, 0}, false, false);  // outside of the ball
  defined(sphere, {0, 0, 0}, true, false);       // no gradient
  defined("sqrt(x)", {-0.5, 0, 0}, false, false);
  defined("sqrt(x)", {0, 0, 0}, true, false);
  defined("x*abs(x)^1.5 + y", {0, 0.5, 0}, true, false);  // value and gradient, but no second derivatives
  defined("1/x", {0, 0, 0}, false, false);
  defined("exp(1000*x)", {1, 0, 0}, false, false);
  defined(sphere, {std::numeric_limits<double>::quiet_NaN(), 0, 0}, false, false);
}

TEST(ImplicitReference, PlanesAreUmbilic) {
  for (const std::string text :
       {"x + 0.3*y - 0.7*z", "exp(x + 0.3*y - 0.7*z) - 1", "(x + 0.3*y - 0.7*z)*(x^2+y^2+1)"}) {
    const SurfaceFrame frame = measured(*surface_of(text), {0.4, 1, 1}).frame;
    EXPECT_EQ(frame.status, PointStatus::umbilic) << text;
    EXPECT_NEAR(frame.k1, 0, 1e-12);
  }
}

TEST(ImplicitReference, UpdatesShareTheFunction) {
  const auto surface = surface_of("x^2 + y^2 + z^2", Side::out_of_smaller, box(2), 1);
  const auto interrogation = surface->reference();
  const auto& reference = dynamic_cast<const ReferenceInterrogation&>(*interrogation);
  EXPECT_GT(interrogation->device_bytes(), 0u);
  const auto roots = [&] {
    std::vector<ReferenceHit> hits;
    reference.surface().roots({dvec3(-3, 0, 0), x_axis}, false, hits);
    return hits;
  };
  expect_roots(roots(), {2, 4}, 1e-12);

  const ImplicitSurface moved("implicit", surface->text, surface->function, 2.25, Side::out_of_greater, box(2));
  const auto next = reference.surface().updated(moved);
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->measure({1.5, 0, 0}).frame.k1, -1 / 1.5, 1e-12);
  EXPECT_NEAR(reference.surface().measure({1.5, 0, 0}).frame.k1, 1 / 1.5, 1e-12);
  interrogation->update(std::make_shared<const ImplicitSurface>("implicit", surface->text, surface->function, 2.25,
                                                                surface->side, box(2)));
  expect_roots(roots(), {1.5, 4.5}, 1e-12);

  const auto other = surface_of("x^2 + y^2 + z^2", Side::out_of_smaller, box(2), 0.25);
  EXPECT_FALSE(reference.surface().updated(*other));
  interrogation->update(other);
  expect_roots(roots(), {2.5, 3.5}, 1e-12);
}

}  // namespace
}  // namespace smurf
