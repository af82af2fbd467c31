// The reference for parametric surfaces and patches: which roots there are on a ray, against closed forms, and what
// rays through seams, poles, edges and corners, along rulings and at tangents count.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "reference/surface.hpp"
#include "smurf/surface.hpp"
#include "surfaces/kinds.hpp"
#include "truth/analytic.hpp"
#include "truth/nurbs.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

class Asked {
 public:
  explicit Asked(const Surface& surface) : reference_(refer(surface.model())) {}
  std::vector<ReferenceHit> line(const dvec3& origin, const dvec3& direction) const {
    return ray({origin, direction, -infinity, infinity});
  }
  std::vector<ReferenceHit> ray(const ReferenceRay& ray) const {
    std::vector<ReferenceHit> hits;
    reference_->roots(ray, false, hits);
    return hits;
  }

 private:
  std::shared_ptr<const ReferenceSurface> reference_;
};

Surface torus() { return parametric({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {0, 2 * pi}, {0, 2 * pi}); }
Surface sphere() { return parametric({"cos(v)*cos(u)", "cos(v)*sin(u)", "sin(v)"}, {0, 2 * pi}, {-pi / 2, pi / 2}); }

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  dvec3 direction() {
    std::normal_distribution<double> normal;
    return glm::normalize(dvec3(normal(random_), normal(random_), normal(random_)));
  }

 private:
  std::mt19937_64 random_;
};

void expect_roots(const Asked& asked, const test::AnalyticField& field, int count) {
  Random random(3);
  for (int i = 0; i < count; i++) {
    const dvec3 origin = 5.0 * random.direction();
    const dvec3 target(random.number(-3, 3), random.number(-3, 3), random.number(-1, 1));
    const dvec3 d = (target - origin) * random.number(0.1, 10);
    const std::vector<double> roots = field.roots(0, origin, d, 0, infinity);
    const std::vector<ReferenceHit> hits = asked.ray({origin, d, 0, infinity});
    ASSERT_EQ(hits.size(), roots.size()) << "ray " << i;
    for (std::size_t k = 0; k < hits.size(); k++) {
      EXPECT_NEAR(hits[k].t, roots[k], std::max(1e-11 / glm::length(d), 2 * hits[k].uncertainty)) << "ray " << i;
      EXPECT_EQ(hits[k].status, HitStatus::isolated);
    }
  }
}

TEST(ParametricRoots, OfATorusAreThoseOfTheQuartic) {
  const auto field = test::torus_field(dvec3(0), 2, 1);
  expect_roots(Asked(torus()), *field, 4000);
  expect_roots(Asked(nurbs({test::nurbs_torus(2, 1)})), *field, 2000);
}

TEST(ParametricRoots, OfASphereAreThoseOfTheQuadratic) {
  const auto field = test::sphere_field(dvec3(0), 1);
  expect_roots(Asked(sphere()), *field, 2000);
  expect_roots(Asked(nurbs({test::nurbs_sphere(1)})), *field, 2000);
}

TEST(ParametricRoots, NearTangentsArePairsUntilRoundingHidesThem) {
  for (const Surface& surface : {torus(), nurbs({test::nurbs_torus(2, 1)})}) {
    const Asked asked(surface);
    for (int k = 1; k <= 11; k++) {
      const double x = 3 - std::pow(10.0, -k);
      for (const double z : {0.0, 0.01}) {
        const double outer = 2 + std::sqrt(1 - z * z), turned = outer - std::pow(10.0, -k);
        const auto hits = asked.line({turned, -5, z}, {0, 1, 0});
        ASSERT_EQ(hits.size(), 2u) << "1e-" << k << " at " << z;
        const double y = std::sqrt((outer - turned) * (outer + turned));
        EXPECT_NEAR(hits[0].t, 5 - y, 1e-14 / y + 1e-12);
        EXPECT_NEAR(hits[1].t, 5 + y, 1e-14 / y + 1e-12);
      }
      EXPECT_EQ(asked.line({6 - x, 0.3, -5}, {0, 0, 1}).size(), std::hypot(6 - x, 0.3) < 3 ? 2u : 0u);
      EXPECT_EQ(asked.line({6 - x, -5, 0}, {0, 1, 0}).size(), 0u) << "beside it by 1e-" << k;
    }
    const auto hits = asked.line({3, -5, 0}, {0, 1, 0});
    ASSERT_EQ(hits.size(), 1u);
    EXPECT_EQ(hits[0].status, HitStatus::tangent);
    EXPECT_NEAR(hits[0].t, 5, hits[0].uncertainty);
    EXPECT_LT(hits[0].uncertainty, 1e-5);
  }
}

// Along the circle that a torus is highest on, a line leaves it by y⁴/32.
TEST(ParametricRoots, ContactsOfTheFourthOrderAreOneHit) {
  for (const Surface& surface : {torus(), nurbs({test::nurbs_torus(2, 1)})}) {
    const Asked asked(surface);
    const auto top = asked.line({2, -5, 1}, {0, 1, 0});
    ASSERT_EQ(top.size(), 1u);
    EXPECT_EQ(top[0].status, HitStatus::tangent);
    EXPECT_NEAR(top[0].t, 5, top[0].uncertainty);
    EXPECT_GT(top[0].uncertainty, 1e-3);
    EXPECT_LT(top[0].uncertainty, 1e-2);
    const auto below = asked.line({2, -5, 1 - 1e-6}, {0, 1, 0});
    ASSERT_EQ(below.size(), 2u);
    EXPECT_EQ(below[0].status, HitStatus::isolated);
    EXPECT_NEAR(below[1].t - 5, std::pow(32e-6, 0.25), 1e-3);
    EXPECT_EQ(asked.line({1.875, -5, 1}, {0, 1, 0}).size(), 2u);  // touches it twice
    EXPECT_EQ(asked.line({2, -5, 1 + 1e-6}, {0, 1, 0}).size(), 0u);
  }
}

TEST(ParametricRoots, CountsSeamsOnce) {
  Random random(5);
  for (const Surface& surface :
       {torus(), nurbs({test::nurbs_torus(2, 1)}),
        parametric({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {0, 6.2831853}, {0, 6.2831853})}) {
    const Asked asked(surface);
    const auto field = test::torus_field(dvec3(0), 2, 1);
    for (int i = 0; i < 300; i++) {
      // Through the seam of u (a circle at y = 0), that of v (z = 0, outermost), and where they meet.
      const double angle = random.number(0, 2 * pi);
      const dvec3 of_u(2 + std::cos(angle), 0, std::sin(angle)), of_v(3 * std::cos(angle), 3 * std::sin(angle), 0);
      for (const dvec3& p : {of_u, of_v, dvec3(3, 0, 0)}) {
        const dvec3 d = random.direction(), o = p - 8.0 * d;
        EXPECT_EQ(asked.line(o, d).size(), field->roots(0, o, d, 0, 100).size());
      }
    }
    EXPECT_EQ(asked.line({5, 0, 0}, {-1, 0, 0}).size(), 4u);
    EXPECT_EQ(asked.line({5, 0, 0.25}, {-1, 0, 0}).size(), 4u);
    // Within the gap that 6.2831853 leaves.
    EXPECT_EQ(asked.line({5, -4e-9, 0.25}, {-1, 0, 0}).size(), 4u);
  }
}

TEST(ParametricRoots, CountsPolesOnceAndTellsThemByTheStartOfTheRange) {
  Random random(6);
  for (const Surface& surface : {sphere(), nurbs({test::nurbs_sphere(1)})}) {
    const Asked asked(surface);
    const bool patch = surface.kind() == "nurbs";
    const auto axis = asked.line({0, 0, -3}, {0, 0, 1});
    ASSERT_EQ(axis.size(), 2u);
    for (std::size_t i = 0; i < 2; i++) {
      EXPECT_NEAR(axis[i].t, i == 0 ? 2 : 4, 1e-11);
      EXPECT_EQ(axis[i].coordinates.u, 0);
      EXPECT_FLOAT_EQ(axis[i].coordinates.v, patch ? float(2 * i) : float(i == 0 ? -pi / 2 : pi / 2));
    }
    for (int i = 0; i < 200; i++) {
      const dvec3 d = random.direction(), pole(0, 0, i % 2 == 0 ? 1 : -1);
      EXPECT_EQ(asked.line(pole - 3.0 * d, d).size(), 2u);
      // And close by.
      const dvec3 beside = pole + std::pow(10.0, -random.number(2, 12)) * dvec3(d.y, d.x, 0) - 3.0 * d;
      if (std::abs(d.z) > 0.1) {
        EXPECT_EQ(asked.line(beside, d).size(), 2u);
      }
      // In the plane of the seam.
      const double angle = random.number(0, 2 * pi), offset = random.number(-0.9, 0.9);
      const dvec3 along(std::cos(angle), 0, std::sin(angle)), across(-along.z, 0, along.x);
      EXPECT_EQ(asked.line(offset * across - 3.0 * along, along).size(), 2u);
    }
  }
}

// Lines that pass by a pole nearly along the surface: at it they have a root, and another one not far behind.
TEST(ParametricRoots, FindsBothRootsNextToPoles) {
  Random random(8);
  for (const Surface& surface : {sphere(), nurbs({test::nurbs_sphere(1)})}) {
    const Asked asked(surface);
    for (int i = 0; i < 500; i++) {
      const double slope = std::pow(10.0, -random.number(0, 4)), beside = std::pow(10.0, -random.number(1, 10));
      const double a = random.number(0, 2 * pi), b = random.number(0, 2 * pi);
      const dvec3 d = glm::normalize(dvec3(std::cos(a), std::sin(a), slope));
      const dvec3 root(beside * std::cos(b), beside * std::sin(b), std::sqrt(1 - beside * beside));
      const double other = -2 * glm::dot(root, d);
      if (std::abs(other) < 1e-5) continue;
      const auto hits = asked.line(root - 3.0 * d, d);
      ASSERT_EQ(hits.size(), 2u) << "ray " << i;
      EXPECT_NEAR(hits[0].t, 3 + std::min(0.0, other), 1e-7) << "ray " << i;
      EXPECT_NEAR(hits[1].t, 3 + std::max(0.0, other), 1e-7) << "ray " << i;
    }
  }
}

TEST(ParametricRoots, ContactsAtPolesAreOneHit) {
  for (const Surface& surface : {sphere(), nurbs({test::nurbs_sphere(1)})}) {
    const Asked asked(surface);
    for (const double angle : {0.0, 0.3, 0.5 * pi, 2.0}) {
      const dvec3 d(std::cos(angle), std::sin(angle), 0);
      for (const double z : {-1.0, 1.0}) {
        const auto hits = asked.line(dvec3(0, 0, z) - 3.0 * d, d);
        ASSERT_EQ(hits.size(), 1u) << angle;
        EXPECT_EQ(hits[0].status, HitStatus::tangent);
        EXPECT_NEAR(hits[0].t, 3, hits[0].uncertainty);
      }
    }
  }
}

TEST(ParametricRoots, CountsATipByTheSheetsThatPass) {
  const Asked cone(parametric({"v*cos(u)", "v*sin(u)", "v"}, {0, 2 * pi}, {0, 1}));
  EXPECT_EQ(cone.line({0, 0, -3}, {0, 0, 1}).size(), 1u);
  EXPECT_EQ(cone.line({0, 0.1, -3}, {0, 0, 1}).size(), 1u);
  EXPECT_EQ(cone.line({-3, 0, 0}, {1, 0, 0}).size(), 2u);  // beside it 0 below, 2 above
  EXPECT_EQ(cone.line({-3, 0, 1e-3}, {1, 0, 0}).size(), 2u);
  EXPECT_EQ(cone.line({-3, 0, -1e-3}, {1, 0, 0}).size(), 0u);
}

TEST(ParametricRoots, CountsSharedEdgesAndCornersOnce) {
  std::vector<Patch> patches;
  for (int j = 0; j < 2; j++) {
    for (int i = 0; i < 2; i++)
      patches.push_back(test::bilinear_patch({i, j, 0}, {i + 1, j, 0}, {i, j + 1, 0}, {i + 1, j + 1, 0}));
  }
  const Asked asked(nurbs(patches));
  for (const dvec3& d : {dvec3(0, 0, 1), dvec3(0.3, 0.1, -1), dvec3(5, -2, 0.1)}) {
    EXPECT_EQ(asked.line(dvec3(1, 0.5, 0) - d, d).size(), 1u);
    EXPECT_EQ(asked.line(dvec3(0.3, 1, 0) - d, d).size(), 1u);
    EXPECT_EQ(asked.line(dvec3(1, 1, 0) - d, d).size(), 1u);
    EXPECT_EQ(asked.line(dvec3(0, 0.5, 0) - d, d).size(), 1u);  // where the surface ends
    EXPECT_EQ(asked.line(dvec3(2, 2, 0) - d, d).size(), 1u);
    EXPECT_EQ(asked.line(dvec3(2.001, 2, 0) - d, d).size(), 0u);
  }
  EXPECT_EQ(asked.line({-1, 0.5, 0}, {1, 0, 0}).size(), 0u);  // within the plane
  // A roof: past its ridge from the side there are two sheets.
  const Asked roof(nurbs({test::bilinear_patch({-1, 0, 0}, {0, 0, 1}, {-1, 1, 0}, {0, 1, 1}),
                          test::bilinear_patch({0, 0, 1}, {1, 0, 0}, {0, 1, 1}, {1, 1, 0})}));
  EXPECT_EQ(roof.line({0, 0.5, 3}, {0, 0, -1}).size(), 1u);
  EXPECT_EQ(roof.line({-3, 0.5, 1}, {1, 0, 0}).size(), 2u);
}

TEST(ParametricRoots, LinesWithinTheSurfaceAreOneStretch) {
  const Asked cylinder(nurbs({test::nurbs_cylinder(1, 2)}));
  for (const double angle : {0.0, 0.4, 1.3, pi / 2, 3.0}) {
    const auto hits = cylinder.line({std::cos(angle), std::sin(angle), -3}, {0, 0, 1});
    ASSERT_EQ(hits.size(), 1u) << angle;
    EXPECT_EQ(hits[0].status, HitStatus::unresolved);
    EXPECT_NEAR(hits[0].t, 4, 1e-6);
    EXPECT_NEAR(hits[0].uncertainty, 1, 1e-6);
    EXPECT_EQ(cylinder.line({0.999 * std::cos(angle), 0.999 * std::sin(angle), -3}, {0, 0, 1}).size(), 0u);
    EXPECT_EQ(
        cylinder.line({3 * std::cos(angle), 3 * std::sin(angle), 1}, {-std::cos(angle), -std::sin(angle), 0.1}).size(),
        2u);
  }
  const auto saddle = Asked(parametric({"u", "v", "u*v"}, {-1, 1}, {-1, 1})).line({-3, 0.5, -1.5}, {1, 0, 0.5});
  ASSERT_EQ(saddle.size(), 1u);
  EXPECT_EQ(saddle[0].status, HitStatus::unresolved);
  EXPECT_NEAR(saddle[0].t, 3, 1e-6);
  EXPECT_NEAR(saddle[0].uncertainty, 1, 1e-6);
}

TEST(ParametricRoots, CountsByParameter) {
  // Covered twice: two hits at one place, with their own parameters.
  const Asked twice(parametric({"cos(u)", "sin(u)", "v"}, {0, 4 * pi}, {0, 1}));
  const auto hits = twice.line({-3, 0.1, 0.5}, {1, 0, 0});
  ASSERT_EQ(hits.size(), 4u);
  EXPECT_NEAR(hits[1].coordinates.u - hits[0].coordinates.u, 2 * pi, 1e-5);
  EXPECT_EQ(twice.line({-3, 0, 0.5}, {1, 0, 0}).size(), 4u);  // through the seam, too
  // A Möbius strip passes its seam turned over.
  const Asked strip(parametric({"(2+v*cos(u/2))*cos(u)", "(2+v*cos(u/2))*sin(u)", "v*sin(u/2)"}, {0, 2 * pi}, {-1, 1}));
  EXPECT_EQ(strip.line({2.3, 0, -3}, {0, 0, 1}).size(), 1u);
  EXPECT_EQ(strip.line({2.3, 0, -3}, {0.01, 0.02, 1}).size(), 1u);
}

TEST(ParametricRoots, KeepsToTheRangeOfTheRay) {
  const Asked asked(torus());
  EXPECT_EQ(asked.ray({{5, 0, 0.25}, {-2, 0, 0}, 0, infinity}).size(), 4u);
  EXPECT_EQ(asked.ray({{5, 0, 0.25}, {-2, 0, 0}, 1.5, 3.5}).size(), 2u);
  EXPECT_EQ(asked.ray({{5, 0, 0.25}, {-2, 0, 0}, 10, infinity}).size(), 0u);
  EXPECT_EQ(asked.ray({{5e6, 0, 0.25}, {-1e-3, 0, 0}, 0, infinity}).size(), 4u);
}

// A knot of degree + 1 times: the patch is in two pieces with a gap.
TEST(ParametricRoots, PatchesMayBeParted) {
  Patch patch;
  patch.degree = {1, 1};
  patch.size = {4, 2};
  patch.knots = {std::vector<double>{0, 0, 1, 1, 2, 2}, {0, 0, 1, 1}};
  for (const double y : {0.0, 1.0}) {
    for (const double x : {0.0, 1.0, 2.0, 3.0}) patch.points.emplace_back(x, y, 0, 1);
  }
  const Asked asked(nurbs({patch}));
  for (const auto& [x, count] : {std::pair(0.5, 1u), std::pair(1.0, 1u), std::pair(1.5, 0u), std::pair(2.0, 1u)})
    EXPECT_EQ(asked.line({x, 0.5, -1}, {0, 0, 1}).size(), count) << x;
}

}  // namespace
}  // namespace smurf
