// Comparison of reconstructions, on the reference: what is sampled, orders of convergence, errors in closed form, and
// the counts of roots that one side lacks.
#include "smurf/compare.hpp"
#include "harness/refusal.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "smurf/error.hpp"

namespace smurf {
namespace {

using test::refusal;

using glm::dvec3, glm::ivec3;

Domain box(double half) { return {dvec3(-half), dvec3(half), 0}; }

const char* const gyroid = "sin(6*x)*cos(6*y)+sin(6*y)*cos(6*z)+sin(6*z)*cos(6*x)";
const char* const tanglecube = "x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8";

Comparison compare_on_reference(const Surface& surface, const CompareOptions& options) {
  return compare(open_device("reference"), surface, options);
}

TEST(SampleField, EvaluatesInDoubleAtTheNodes) {
  const Domain domain{dvec3(-1, 0, 2), dvec3(1, 3, 2.5), 0};
  const auto f = [](const dvec3& p) { return std::sin(40 * p.x) + p.y * p.z; };
  for (const int apron : {0, 2}) {
    const SampledField field = sample_field(isosurface("sin(40*x)+y*z", 0.75, domain), ivec3(5, 4, 3), apron);
    EXPECT_EQ(field.isovalue, 0.75);
    EXPECT_EQ(field.volume.size(), ivec3(5, 4, 3) + 2 * apron);
    EXPECT_EQ(field.volume.type(), SampleType::float32);
    const dvec3 step(0.5, 1, 0.25);
    std::size_t index = 0;
    for (int k = -apron; k < 3 + apron; k++)
      for (int j = -apron; j < 4 + apron; j++)
        for (int i = -apron; i < 5 + apron; i++)
          EXPECT_EQ(field.volume.at(index++), double(float(f(domain.lower + step * dvec3(i, j, k)))));
    EXPECT_EQ(field.volume.placement().origin, domain.lower - double(apron) * step);
  }
}

TEST(SampleField, TurnsImplicitSurfacesSoThatNormalsAgree) {
  const SampledField field = sample_field(implicit("x-0.25", box(1)), ivec3(3));
  EXPECT_EQ(field.isovalue, 0);
  EXPECT_EQ(field.volume.at(0), 1.25);  // minus the equation's value at x = -1
}

TEST(SampleField, RefusesWhatItCannotSample) {
  const auto input = [](auto action) { return refusal(ErrorCode::input, action); };
  const Surface grid = isosurface(marschner_lobb_volume(8), 0.5);
  EXPECT_NE(input([&] { sample_field(grid, ivec3(4)); }).find("expression"), std::string::npos);
  const Surface plane = implicit("x", box(1));
  EXPECT_NE(input([&] { sample_field(plane, ivec3(4, 1, 4)); }).find("4 x 1 x 4"), std::string::npos);
  EXPECT_NE(input([&] { sample_field(plane, ivec3(4), -1); }).find("-1"), std::string::npos);
  EXPECT_NE(input([&] { sample_field(plane, ivec3(2000)); }).find("2000"), std::string::npos);
  const Surface flat = implicit("x", {dvec3(-1, 0, -1), dvec3(1, 0, 1), 0});
  EXPECT_NE(input([&] { sample_field(flat, ivec3(4)); }).find("along y"), std::string::npos);
}

struct Orders {
  double location, normal, mean, gauss;
};

// Of the interpolants: linear 2; Catmull-Rom, which is cubic convolution, 3 (Keys 1981); the cubic spline 4 (Unser
// 1999). A derivative costs one, and curvature is made of second derivatives. Trilinear's derivatives are no
// derivatives of it, but central differences, interpolated: second order both.
constexpr Orders expected_orders(Reconstruction reconstruction) {
  switch (reconstruction) {
    case Reconstruction::trilinear:
      return {2, 2, 2, 2};
    case Reconstruction::catmull_rom:
      return {3, 2, 1, 1};
    case Reconstruction::tricubic:
      break;
  }
  return {4, 3, 2, 2};
}

const char* const surface_names[] = {"Sphere", "Gyroid", "Tanglecube"};

class CompareOrders : public testing::TestWithParam<int> {};

// From 32 to 64 nodes, where these surfaces are resolved and rounding is far. What is left of the next power of the
// step, and the chance of a few hundred points, come to less than a quarter of an order.
TEST_P(CompareOrders, AreThoseOfTheTheory) {
  const std::array surfaces{implicit("sqrt(x^2+y^2+z^2)-1", box(1.5)), isosurface(gyroid, 0.3, box(1)),
                            implicit(tanglecube, box(3))};
  const Comparison comparison =
      compare_on_reference(surfaces[std::size_t(GetParam())], {.resolutions = {32, 64}, .rays = 600});
  ASSERT_EQ(comparison.rows.size(), 6u);
  EXPECT_GT(comparison.points, 200u);
  for (const ComparisonRow& row : comparison.rows) {
    SCOPED_TRACE(std::string(name_of(row.reconstruction)) + " at " + std::to_string(row.resolution));
    EXPECT_EQ(row.lost + row.undefined, 0u);
    if (row.resolution == 32) {
      EXPECT_TRUE(std::isnan(row.location.order));
      continue;
    }
    const Orders expected = expected_orders(row.reconstruction);
    EXPECT_NEAR(row.location.order, expected.location, 0.25);
    EXPECT_NEAR(row.normal.order, expected.normal, 0.25);
    EXPECT_NEAR(row.mean.order, expected.mean, 0.25);
    // Of the tanglecube Gauss curvature is so uneven that few points make most of the mean square.
    EXPECT_NEAR(row.gauss.order, expected.gauss, GetParam() == 2 ? 0.6 : 0.25);
    EXPECT_GE(row.location.greatest, row.location.rms);
  }
}

INSTANTIATE_TEST_SUITE_P(Surfaces, CompareOrders, testing::Values(0, 1, 2),
                         [](const auto& info) { return std::string(surface_names[info.param]); });

TEST(Compare, CubicReconstructionsOfAQuadricAreExact) {
  // Both reproduce polynomials of degree 2, but for the rounding of samples to float: 3e-7 of values up to 9, whose
  // second differences are divided by twice the square of the step, 0.04.
  const Comparison comparison =
      compare_on_reference(implicit("x^2+y^2+z^2-1", box(1.5)), {.resolutions = {16}, .rays = 500});
  EXPECT_NEAR(comparison.mean_rms, 1, 1e-6);
  EXPECT_NEAR(comparison.gauss_rms, 1, 1e-6);
  EXPECT_EQ(comparison.singular, 0u);
  EXPECT_EQ(comparison.points, comparison.roots);
  for (const ComparisonRow& row : comparison.rows) {
    if (row.reconstruction == Reconstruction::trilinear) continue;
    SCOPED_TRACE(name_of(row.reconstruction));
    EXPECT_LT(row.location.greatest, 5e-7);
    EXPECT_LT(row.normal.greatest, 5e-6);
    EXPECT_LT(row.mean.greatest, 5e-5);
    EXPECT_LT(row.gauss.greatest, 1e-4);
    EXPECT_EQ(row.missed + row.invented + row.undecided, 0u);
  }
}

TEST(Compare, TrilinearErrorOfAQuadricIsInClosedForm) {
  // Between nodes x² is too great by u(1-u)h², 0 <= u <= 1, along each axis, and the gradient has length 2: with u
  // spread evenly the mean square of the distance is h⁴/4 (3/180 + (3/6)²).
  const Comparison comparison =
      compare_on_reference(implicit("x^2+y^2+z^2-1", box(1.5)),
                           {.resolutions = {64}, .reconstructions = {Reconstruction::trilinear}, .rays = 3000});
  const ComparisonRow& row = comparison.rows.front();
  EXPECT_DOUBLE_EQ(row.step, 3.0 / 63);
  const double expected = 0.5 * row.step * row.step * std::sqrt(3.0 / 180 + 0.25);
  EXPECT_NEAR(row.location.rms, expected, 0.03 * expected);             // by chance: over a thousand points
  EXPECT_LT(row.location.greatest, 0.5 * row.step * row.step * 0.751);  // 3/4 in the middle of a cell
}

TEST(Compare, NormalsOfBothKindsAreTurnedRight) {
  // The same surface with the same normals, by -f and by f.
  const CompareOptions options{.resolutions = {16}, .rays = 100};
  const Comparison a = compare_on_reference(implicit(gyroid, box(1)), options);
  const Comparison b = compare_on_reference(isosurface("-(" + std::string(gyroid) + ")", 0, box(1)), options);
  ASSERT_EQ(a.rows.size(), b.rows.size());
  for (std::size_t i = 0; i < a.rows.size(); i++) {
    EXPECT_LT(a.rows[i].normal.greatest, 0.1);
    EXPECT_NEAR(a.rows[i].normal.rms, b.rows[i].normal.rms, 1e-6);
    EXPECT_NEAR(a.rows[i].mean.rms, b.rows[i].mean.rms, 1e-5);
  }
}

TEST(Compare, CountsWhatAReconstructionMisses) {
  // A plate thinner than a cell: it is between the nodes, and trilinear reconstruction sees nothing of it.
  const Comparison comparison = compare_on_reference(
      implicit("z^2-0.0004", box(1)),
      {.resolutions = {4}, .reconstructions = {Reconstruction::trilinear}, .rays = 200, .margin = 0.1});
  const ComparisonRow& row = comparison.rows.front();
  EXPECT_GT(comparison.roots, 50u);
  EXPECT_GT(comparison.near_boundary, 0u);
  EXPECT_EQ(row.missed, comparison.roots);
  EXPECT_EQ(row.lost, comparison.points);
  EXPECT_EQ(row.invented, 0u);
  EXPECT_TRUE(std::isnan(row.location.rms));
}

TEST(Compare, CountsWhatAReconstructionInvents) {
  // The plane x = 0.51, and a step from 0.05 to 2.05 that has no root. Cubic reconstructions overshoot by a fourteenth
  // of the step and more: below 0, and above it again.
  const Comparison comparison =
      compare_on_reference(implicit("(tanh(50*z)+1.05)*(x-0.51)", box(1)), {.resolutions = {8}, .rays = 300});
  for (const ComparisonRow& row : comparison.rows) {
    SCOPED_TRACE(name_of(row.reconstruction));
    EXPECT_EQ(row.missed, 0u);
    if (row.reconstruction == Reconstruction::trilinear) EXPECT_EQ(row.invented, 0u);
    else EXPECT_GT(row.invented, 100u);
  }
}

TEST(Compare, LooksOnlyWithinABall) {
  // The plane goes on outside of the ball, in the samples as well.
  const Comparison comparison = compare_on_reference(implicit("z-0.1*x", {dvec3(-1.5), dvec3(1.5), 1.2}),
                                                     {.resolutions = {8}, .rays = 300, .margin = 0.1});
  EXPECT_GT(comparison.near_boundary, 0u);
  for (const ComparisonRow& row : comparison.rows) {
    EXPECT_EQ(row.missed + row.invented + row.lost, 0u);
    EXPECT_LT(row.location.greatest, 1e-6);
  }
}

TEST(Compare, TellsOfSamplesThatAreNotFinite) {
  const CompareOptions options{.resolutions = {8}, .rays = 100};
  EXPECT_GT(compare_on_reference(implicit("sqrt(x)-0.7", {dvec3(0), dvec3(1), 0}), options).rows[0].not_finite, 0u);
  EXPECT_EQ(compare_on_reference(implicit("x-0.7", {dvec3(0), dvec3(1), 0}), options).rows[0].not_finite, 0u);
}

TEST(Compare, TheSeedDecidesTheChords) {
  const Surface sphere = implicit("x^2+y^2+z^2-1", box(1.5));
  CompareOptions options{.resolutions = {8}, .rays = 100};
  const Comparison a = compare_on_reference(sphere, options), b = compare_on_reference(sphere, options);
  options.seed = 2;
  const Comparison c = compare_on_reference(sphere, options);
  EXPECT_EQ(a.rows[0].location.rms, b.rows[0].location.rms);
  EXPECT_NE(a.rows[0].location.rms, c.rows[0].location.rms);
}

TEST(Compare, RefusesOptionsThatCannotBeMeant) {
  const Surface sphere = implicit("x^2+y^2+z^2-1", box(1.5));
  const auto refused = [&](const CompareOptions& options, ErrorCode code = ErrorCode::usage) {
    return refusal(code, [&] { compare_on_reference(sphere, options); });
  };
  EXPECT_NE(refused({.resolutions = {}}).find("resolutions"), std::string::npos);
  EXPECT_NE(refused({.resolutions = {1, 16}}).find("not 1"), std::string::npos);
  EXPECT_NE(refused({.resolutions = {16, 16}}).find("16 follows on 16"), std::string::npos);
  EXPECT_NE(refused({.resolutions = {16, 2000}}).find("2000"), std::string::npos);
  EXPECT_NE(refused({.reconstructions = {}}).find("reconstructions"), std::string::npos);
  EXPECT_NE(refused({.rays = 0}).find("ray"), std::string::npos);
  EXPECT_NE(refused({.apron = -1}).find("apron"), std::string::npos);
  EXPECT_NE(refused({.margin = -1}).find("margin"), std::string::npos);
  EXPECT_NE(refused({.margin = 1.5}).find("margin"), std::string::npos);
  EXPECT_NE(refused({.resolutions = {8}, .rays = 50, .margin = 1.2}, ErrorCode::input).find("nothing to compare"),
            std::string::npos);
}

}  // namespace
}  // namespace smurf
