// Bounds of second derivatives of fields: no second derivative is greater, and bounds are not much greater than these.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "flows/definition.hpp"
#include "harness/devices.hpp"
#include "smurf/flow.hpp"

namespace smurf::test {
namespace {

using glm::dvec3;

double bend_along(const std::array<glm::vec3, 6>& h, const dvec3& a) {
  const auto second = [&](std::size_t k) { return dvec3(h[k]); };
  return glm::length(a.x * a.x * second(0) + a.y * a.y * second(1) + a.z * a.z * second(2) +
                     2.0 * (a.x * a.y * second(3) + a.x * a.z * second(4) + a.y * a.z * second(5)));
}

// In boxes of a tenth of the field.
void expect_bounds(const VectorField& field, double at_most_times) {
  const Bounds all = field.bounds();
  const dvec3 size = all.upper - all.lower;
  const Tracer tracer(reference_device(), field);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> gauss;
  double greatest_ratio = 0;
  for (int box = 0; box < 30; box++) {
    const dvec3 lower = all.lower + 0.9 * dvec3(uniform(random), uniform(random), uniform(random)) * size;
    const double bound = field.model().greatest_bend({lower, lower + 0.1 * size});
    std::vector<glm::vec3> points;
    for (int i = 0; i < 200; i++)
      points.emplace_back(lower + 0.1 * dvec3(uniform(random), uniform(random), uniform(random)) * size);
    const FlowSamples samples = tracer.sample(points, 2);
    double greatest = 0;
    for (const auto& hessian : samples.hessian) {
      for (int k = 0; k < 20; k++) {
        const dvec3 a = glm::normalize(dvec3(gauss(random), gauss(random), gauss(random)));
        greatest = std::max(greatest, bend_along(hessian, a));
      }
    }
    ASSERT_GT(greatest, 0);
    // The reference's derivatives are differences, good to 1e-5.
    EXPECT_LE(greatest, bound * (1 + 1e-5));
    greatest_ratio = std::max(greatest_ratio, bound / greatest);
  }
  EXPECT_LE(greatest_ratio, at_most_times);
}

TEST(GreatestBend, OfATricubicFieldOnASkewedGrid) {
  VectorGrid grid;
  grid.size = {9, 7, 8};
  grid.placement.origin = {1, -2, 0.5};
  grid.placement.axes = glm::dmat3(dvec3(0.5, 0.1, 0), dvec3(-0.2, 0.8, 0.1), dvec3(0, 0.3, 0.6));
  std::mt19937 random(9);
  std::normal_distribution<float> gauss;
  for (int i = 0; i < 9 * 7 * 8; i++) grid.vectors.push_back({gauss(random), gauss(random), gauss(random)});
  VectorField field = grid_flow(grid, VectorReconstruction::tricubic);
  const dvec3 centre = grid.placement.origin + grid.placement.axes * dvec3(4, 3, 3.5);
  // Boxes within the grid: of the sheared one's bounds the middle.
  const Tracer tracer(reference_device(), field);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double greatest_ratio = 0;
  for (int box = 0; box < 40; box++) {
    const dvec3 middle = centre + 0.4 * dvec3(uniform(random), uniform(random), uniform(random));
    const dvec3 half(0.2);
    const double bound = field.model().greatest_bend({middle - half, middle + half});
    std::vector<glm::vec3> points;
    for (int i = 0; i < 200; i++)
      points.emplace_back(middle + dvec3(uniform(random), uniform(random), uniform(random)) * half);
    const FlowSamples samples = tracer.sample(points, 2);
    double greatest = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      ASSERT_EQ(samples.status[i], FlowStatus::inside);
      for (int k = 0; k < 20; k++) {
        const dvec3 a = glm::normalize(dvec3(uniform(random), uniform(random), uniform(random)));
        greatest = std::max(greatest, bend_along(samples.hessian[i], a));
      }
    }
    EXPECT_LE(greatest, bound * (1 + 1e-5));
    greatest_ratio = std::max(greatest_ratio, bound / greatest);
  }
  EXPECT_LE(greatest_ratio, 40);  // random vectors: differences of neighbouring cells count as well
}

TEST(GreatestBend, OfExpressions) {
  expect_bounds(expression_flow({"sin(2*y)*z", "x*x*z+cos(z)", "exp(0.3*x)*y"}, {dvec3(-2), dvec3(2)}), 3);
}

TEST(GreatestBend, IsUnknownWhereDerivativesJump) {
  const Bounds box{dvec3(-1), dvec3(1)};
  EXPECT_TRUE(std::isinf(expression_flow({"abs(x)", "y", "1"}, {dvec3(-2), dvec3(2)}).model().greatest_bend(box)));
  VectorGrid grid;
  grid.size = {2, 2, 2};
  grid.placement.axes = glm::dmat3(1.0);
  for (int i = 0; i < 8; i++) grid.vectors.push_back({float(i), 1, 0});
  EXPECT_TRUE(std::isinf(grid_flow(grid).model().greatest_bend({dvec3(0), dvec3(1)})));
}

}  // namespace
}  // namespace smurf::test
