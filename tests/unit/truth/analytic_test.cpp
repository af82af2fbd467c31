// The analytic fields that the tests trust: derivatives against differences, roots against values, curvature against
// textbook formulas.
#include "truth/analytic.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "harness/tolerances.hpp"
#include "truth/jet.hpp"
#include "truth/polynomial.hpp"
#include "truth/rays.hpp"

namespace smurf::test {
namespace {

struct Named {
  const char* name;
  FieldPointer field;
  double level;
};

std::vector<Named> all_fields() {
  const GridPlacement sheared = centered(sheared_placement(0.1, 3), glm::ivec3(20));
  return {{"sphere", sphere_field({0.1, 0.2, -0.1}, 0.7), 0.05},
          {"cylinder", cylinder_field({0.1, 0, 0}, {1, 2, 3}, 0.5), 0},
          {"torus", torus_field({0, 0.1, 0}, 0.6, 0.25), 0.02},
          {"Marschner-Lobb", marschner_lobb_field(), 0.5},
          {"layers", layers_field({9, 4, 1}), 0.25},
          {"polynomial", random_polynomial_field(3, glm::ivec3(20), sheared, 7), 0.1}};
}

TEST(AnalyticFields, DerivativesAgreeWithDifferences) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-0.9, 0.9);
  for (const Named& n : all_fields()) {
    for (int i = 0; i < 100; i++) {
      const glm::dvec3 p(uniform(random), uniform(random), uniform(random));
      const Jet jet = n.field->at(p);
      const double h = 1e-5;
      for (int axis = 0; axis < 3; axis++) {
        glm::dvec3 step(0.0);
        step[axis] = h;
        const Jet after = n.field->at(p + step), before = n.field->at(p - step);
        EXPECT_NEAR((after.value - before.value) / (2 * h), jet.gradient[axis],
                    1e-5 * (1 + std::abs(jet.gradient[axis])))
            << n.name;
        const glm::dvec3 column = (after.gradient - before.gradient) / (2 * h);
        EXPECT_LT(glm::length(column - jet.hessian[axis]), 1e-4 * (1 + glm::length(jet.hessian[axis]))) << n.name;
      }
    }
  }
}

TEST(AnalyticFields, RootsAreWhereTheFieldHasTheLevel) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-0.9, 0.9);
  for (const Named& n : all_fields()) {
    std::size_t found = 0;
    for (int i = 0; i < 50; i++) {
      const glm::dvec3 a(uniform(random), uniform(random), uniform(random)),
          b(uniform(random), uniform(random), uniform(random));
      const glm::dvec3 d = b - a, o = a - d;
      const std::vector<double> roots = n.field->roots(n.level, o, d, 0.5, 2.5);
      found += roots.size();
      double before = 0.5;
      for (double t : roots) {
        EXPECT_GE(t, before) << n.name;
        EXPECT_NEAR(n.field->at(o + t * d).value, n.level, 1e-9) << n.name;
        before = t;
      }
      // As many as dense sampling sees, but for pairs between two samples.
      const std::vector<double> sampled = n.field->AnalyticField::roots(n.level, o, d, 0.5, 2.5);
      EXPECT_GE(roots.size(), sampled.size()) << n.name;
      EXPECT_EQ((roots.size() - sampled.size()) % 2, 0u) << n.name;
    }
    EXPECT_GT(found, 10u) << n.name;
  }
}

TEST(AnalyticFields, CurvatureIsThatOfTheTextbook) {
  // Outward normals: a sphere's curvatures are 1/r.
  const Differential sphere = differential_of(sphere_field(glm::dvec3(0.0), 2)->at({0, 1.2, 1.6}));
  EXPECT_NEAR(sphere.k1, 0.5, 1e-12);
  EXPECT_NEAR(sphere.k2, 0.5, 1e-12);
  EXPECT_LT(glm::length(sphere.normal - glm::dvec3(0, 0.6, 0.8)), 1e-12);

  const Differential cylinder = differential_of(cylinder_field(glm::dvec3(0.0), {0, 0, 1}, 0.5)->at({0.5, 0, 3}));
  EXPECT_NEAR(cylinder.k1, 2, 1e-12);
  EXPECT_NEAR(cylinder.k2, 0, 1e-12);
  EXPECT_NEAR(std::abs(cylinder.d2.z), 1, 1e-12);
  EXPECT_NEAR(normal_curvature_along(cylinder, {5, 1, 1}), 1, 1e-12);

  // On the inner rim of a torus: 1/tube around the tube, -1/(ring - tube) around the ring.
  const Differential torus = differential_of(torus_field(glm::dvec3(0.0), 3, 1)->at({2, 0, 0}));
  EXPECT_NEAR(torus.k1, 1, 1e-12);
  EXPECT_NEAR(torus.k2, -0.5, 1e-12);
  EXPECT_NEAR(torus.gauss, -0.5, 1e-12);
  EXPECT_NEAR(torus.mean, 0.25, 1e-12);
}

TEST(Polynomials, AllSimpleRootsAreFound) {
  Polynomial p = constant(1);
  for (int i = 0; i < 9; i++) p = p * linear(-(0.1L + 0.1L * i), 1);
  const auto roots = p.roots(0, 1);
  ASSERT_EQ(roots.size(), 9u);
  for (std::size_t i = 0; i < 9; i++) EXPECT_NEAR(double(roots[i]), 0.1 + 0.1 * double(i), 1e-12);
  EXPECT_TRUE((p * p + constant(1e-6L)).roots(0, 1).empty());
}

TEST(RayFamilies, AreTheSameEveryTimeAndValidWhereTheySaySo) {
  const GridFrame frame{{12, 9, 7}, sheared_placement(0.5, 4)};
  const std::vector<SurfaceSample> samples{{{1, 2, 3}, {0, 0, 1}}};
  const auto a = hostile_families(frame, samples, 44, 5), b = hostile_families(frame, samples, 44, 5);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); i++) {
    EXPECT_EQ(a[i].rays.size(), 44u);
    EXPECT_EQ(std::memcmp(a[i].rays.data(), b[i].rays.data(), 44 * 8 * sizeof(float)), 0) << a[i].name;
    for (std::size_t r = 0; r < 44 && a[i].valid; r++) {
      const Ray ray = a[i].rays[r];
      EXPECT_TRUE(std::isfinite(ray.origin.x + ray.origin.y + ray.origin.z + ray.direction.x + ray.direction.y +
                                ray.direction.z));
      EXPECT_NE(ray.direction, glm::vec3(0.0f)) << a[i].name;
      EXPECT_LE(ray.t_min, ray.t_max) << a[i].name;
    }
  }
}

TEST(Tolerances, EachHasAReason) {
  for (const Tolerance& row : tolerance_table) {
    EXPECT_FALSE(row.reason.empty());
    EXPECT_GT(row.value, 0);
  }
}

}  // namespace
}  // namespace smurf::test
