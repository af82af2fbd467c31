// Roots and curvature of the reference of expressions against closed forms; multiple roots. Nothing here needs a
// device.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "unit/reference/implicit_reference.hpp"

namespace smurf::reference_test {
namespace {

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

}  // namespace
}  // namespace smurf::reference_test
