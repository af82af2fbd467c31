// Vector fields on regular grids: affine fields, which both reconstructions reproduce; orders of convergence; vectors
// that are not finite; points outside, on the border and on nodes; the same answers on every device.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <random>
#include <vector>

#include "flows/definition.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/refusal.hpp"
#include "smurf/flow.hpp"

KERNELS(vector_prefilter, vector_pad, sample_flow);

namespace smurf::test {
namespace {

using glm::dmat3;
using glm::dvec3;
using glm::ivec3;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr VectorReconstruction reconstructions[] = {VectorReconstruction::trilinear, VectorReconstruction::tricubic};

std::string name_of(VectorReconstruction reconstruction) {
  return reconstruction == VectorReconstruction::tricubic ? "tricubic" : "trilinear";
}

struct Jet {
  dvec3 value{0.0};
  dmat3 jacobian{0.0};  // column c: by x_c
  std::array<dvec3, 6> hessian{};
};
using Field = std::function<Jet(const dvec3&)>;

VectorGrid sampled(const Field& field, const ivec3& size, const GridPlacement& placement) {
  VectorGrid grid{size, placement, {}};
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++)
        grid.vectors.emplace_back(field(placement.origin + placement.axes * dvec3(i, j, k)).value);
  return grid;
}

dmat3 rotation(double angle, const dvec3& about) {
  const dvec3 n = glm::normalize(about);
  const dmat3 cross(0, n.z, -n.y, -n.z, 0, n.x, n.y, -n.x, 0);
  return dmat3(1.0) + std::sin(angle) * cross + (1 - std::cos(angle)) * (cross * cross);
}

struct Placed {
  const char* name;
  GridPlacement placement;
};

// Cells of size 0.1 to 0.3.
std::vector<Placed> placements() {
  const dmat3 stretch(0.1, 0, 0, 0, 0.2, 0, 0, 0, 0.3);
  const dmat3 shear(0.1, 0.02, 0, -0.05, 0.2, 0.04, 0.1, 0.03, 0.3);
  const dmat3 turn = rotation(0.7, {1, 2, -1});
  return {{"aligned", {stretch, {-0.3, 0.2, 1.1}}},
          {"mirrored", {dmat3(-0.1, 0, 0, 0, 0.2, 0, 0, 0, 0.3), {1, 2, 3}}},
          {"rotated", {turn * stretch, {0.5, -2, 1}}},
          {"sheared", {shear, {0.5, -2, 1}}},
          {"left-handed", {dmat3(shear[1], shear[0], shear[2]), {-1, 0, 2}}},
          {"aligned, far away", {stretch, dvec3(1e4, -1e4, 2e4)}},
          {"rotated, far away", {turn * stretch, dvec3(1e4, -1e4, 2e4)}}};
}

dvec3 index_of(const GridPlacement& placement, const dvec3& p) {
  return glm::inverse(placement.axes) * (p - placement.origin);
}

// Points as floats, less than half a cell outside of the grid or not at all.
std::vector<glm::vec3> points_in(const ivec3& size, const GridPlacement& placement, std::size_t count, unsigned seed,
                                 double margin = 0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<glm::vec3> points;
  while (points.size() < count) {
    dvec3 q;
    for (int a = 0; a < 3; a++) q[a] = margin + uniform(random) * (size[a] - 1 - 2 * margin);
    points.emplace_back(placement.origin + placement.axes * q);
  }
  return points;
}

// The greatest errors of samples, of the value, first and second derivatives.
struct Errors {
  double value = 0, first = 0, second = 0;
};

Errors errors_of(const FlowSamples& samples, std::span<const glm::vec3> points, const Field& field) {
  Errors worst;
  const auto larger = [](double& most, double error) { most = std::isnan(error) ? HUGE_VAL : std::max(most, error); };
  for (std::size_t i = 0; i < points.size(); i++) {
    const Jet jet = field(dvec3(points[i]));
    larger(worst.value, glm::length(dvec3(samples.value[i]) - jet.value));
    for (int c = 0; c < 3; c++) larger(worst.first, glm::length(dvec3(samples.jacobian[i][c]) - jet.jacobian[c]));
    for (std::size_t c = 0; c < 6; c++)
      larger(worst.second, glm::length(dvec3(samples.hessian[i][c]) - jet.hessian[c]));
  }
  return worst;
}

// By how much rounding moves a point: one of the border may lie outside then.
double distance_by_rounding(const GridPlacement& placement) { return 0x1p-24 * 2 * glm::length(placement.origin); }

// Errors in units of the rounding of the greatest vector. The vectors are rounded, interpolation adds some six
// roundings, and the place in the cell carries that of coordinates in the grid. A derivative is a difference of two
// vectors by the size of a cell, a second one of three. Tricubic coefficients carry a rounding or two of each of three
// passes. Measured: 5, 2.8 and 6.4 units; three times as much is allowed.
void expect_affine(const Placed& placed, const ivec3& size, VectorReconstruction reconstruction) {
  const dmat3 slope(0.3, -1.1, 0.7, 0.9, 0.4, -0.2, -0.6, 0.5, -0.8);
  const dvec3 middle = placed.placement.origin + placed.placement.axes * (0.5 * dvec3(size - 1));
  const Field field = [&](const dvec3& p) {
    Jet jet;
    jet.value = slope * (p - middle) + dvec3(0.2, -0.1, 0.3);
    jet.jacobian = slope;
    return jet;
  };
  const VectorGrid grid = sampled(field, size, placed.placement);
  const VectorField flow = grid_flow(grid, reconstruction);
  double greatest = 0;
  for (const glm::vec3& v : grid.vectors) greatest = std::max(greatest, glm::length(dvec3(v)));
  const double unit = 0x1p-24 * greatest;
  const dmat3 to_index = glm::inverse(placed.placement.axes);
  double steep = 0;
  for (int c = 0; c < 3; c++) {
    const dvec3 column = glm::abs(to_index[c]);
    steep = std::max(steep, column.x + column.y + column.z);
  }
  const std::vector<glm::vec3> points = points_in(size, placed.placement, 2000, 7, 0.0);
  for (TestDevice& device : one_of_each()) {
    const std::string where = std::string(placed.name) + ", " + std::to_string(size.x) + " x " +
                              std::to_string(size.y) + " x " + std::to_string(size.z) + ", " + name_of(reconstruction) +
                              ", " + device.label;
    const FlowSamples samples = Tracer(device.device, flow).sample(points, 2);
    for (const FlowStatus status : samples.status) ASSERT_EQ(status, FlowStatus::inside) << where;
    const Errors worst = errors_of(samples, points, field);
    EXPECT_LT(worst.value, 16 * unit) << where;
    EXPECT_LT(worst.first, 8 * unit * steep) << where;
    EXPECT_LT(worst.second, 20 * unit * steep * steep) << where;
    std::cerr << "  " << where << ": value " << worst.value / unit << ", first " << worst.first / (unit * steep)
              << ", second " << worst.second / (unit * steep * steep) << " units\n";
    // The cell is the one that holds the point, but for rounding at its faces.
    for (std::size_t i = 0; i < points.size(); i++) {
      const ivec3 cells = size - 1;
      const std::int32_t cell = samples.cell[i];
      ASSERT_TRUE(cell >= 0 && cell < cells.x * cells.y * cells.z) << where;
      const dvec3 index(cell % cells.x, cell / cells.x % cells.y, cell / (cells.x * cells.y));
      const dvec3 off = glm::abs(index + dvec3(samples.local[i]) - index_of(placed.placement, dvec3(points[i])));
      const double close =
          4 * 0x1p-24 * std::max({size.x, size.y, size.z}) + steep * distance_by_rounding(placed.placement);
      EXPECT_LT(std::max({off.x, off.y, off.z}), close) << where;
      const glm::vec3 local = samples.local[i];
      EXPECT_GT(std::min({local.x, local.y, local.z}), -close) << where;
      EXPECT_LT(std::max({local.x, local.y, local.z}), 1 + close) << where;
    }
  }
}

TEST(GridFields, AffineFieldsAreReproduced) {
  for (const Placed& placed : placements())
    for (const VectorReconstruction reconstruction : reconstructions) expect_affine(placed, {9, 7, 12}, reconstruction);
}

TEST(GridFields, SmallGrids) {
  const std::vector<Placed> all = placements();
  for (const VectorReconstruction reconstruction : reconstructions) {
    for (const ivec3& size : {ivec3(2, 2, 2), ivec3(2, 5, 3), ivec3(3, 2, 4)}) {
      expect_affine(all[0], size, reconstruction);
      expect_affine(all[3], size, reconstruction);
    }
  }
}

// Arnold, Beltrami and Childress's flow, with its derivatives.
Jet abc(const dvec3& p) {
  const double a = std::sqrt(3.0), b = std::sqrt(2.0), c = 1;
  const dvec3 s = glm::sin(p), o = glm::cos(p);
  Jet jet;
  jet.value = {a * s.z + c * o.y, b * s.x + a * o.z, c * s.y + b * o.x};
  jet.jacobian = {dvec3(0, b * o.x, -b * s.x), dvec3(-c * s.y, 0, c * o.y), dvec3(a * o.z, -a * s.z, 0)};
  jet.hessian = {dvec3(0, -b * s.x, -b * o.x),
                 dvec3(-c * o.y, 0, -c * s.y),
                 dvec3(-a * s.z, -a * o.z, 0),
                 dvec3(0),
                 dvec3(0),
                 dvec3(0)};
  return jet;
}

// A grid of spacing h, turned, whose border is 12 cells from the ball of radius 1 about the origin: what the ends do
// fades by 2 - √3 a node, and is 1e-7 there.
Errors errors_at(TestDevice& device, double h, VectorReconstruction reconstruction) {
  const int half = int(std::ceil(1 / h)) + 12;
  GridPlacement placement{h * rotation(0.4, {1, -1, 2}), dvec3(0)};
  placement.origin = placement.axes * dvec3(-half);
  const VectorField flow = grid_flow(sampled(abc, ivec3(2 * half + 1), placement), reconstruction);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-0.57f, 0.57f);
  std::vector<glm::vec3> points(3000);
  for (glm::vec3& p : points) p = {uniform(random), uniform(random), uniform(random)};
  return errors_of(Tracer(device.device, flow).sample(points, 2), points, abc);
}

// Errors of cubic splines fall with h⁴, h³ and h² (de Boor 1978), those of trilinear interpolation with h² and h. The
// rounding of values, some 1e-6, and constants that vary leave a third of an order.
TEST(GridFields, OrdersOfConvergence) {
  for (TestDevice& device : one_of_each()) {
    const Errors coarse = errors_at(device, 0.5, VectorReconstruction::tricubic);
    const Errors fine = errors_at(device, 0.25, VectorReconstruction::tricubic);
    std::cerr << "  " << device.label << ", tricubic: orders " << std::log2(coarse.value / fine.value) << ", "
              << std::log2(coarse.first / fine.first) << ", " << std::log2(coarse.second / fine.second) << "\n";
    EXPECT_GT(std::log2(coarse.value / fine.value), 4 - 1.0 / 3) << device.label;
    EXPECT_GT(std::log2(coarse.first / fine.first), 3 - 1.0 / 3) << device.label;
    EXPECT_GT(std::log2(coarse.second / fine.second), 2 - 1.0 / 3) << device.label;
    EXPECT_LT(fine.value, 5e-5) << device.label;
    const Errors coarse_linear = errors_at(device, 0.5, VectorReconstruction::trilinear);
    const Errors fine_linear = errors_at(device, 0.25, VectorReconstruction::trilinear);
    EXPECT_NEAR(std::log2(coarse_linear.value / fine_linear.value), 2, 1.0 / 3) << device.label;
    EXPECT_NEAR(std::log2(coarse_linear.first / fine_linear.first), 1, 1.0 / 3) << device.label;
  }
}

// A vector that is not finite makes cells undefined: those that it is a corner of, of tricubic fields those that have
// it among the 4³ nodes that they are made of. Elsewhere the field is that of a zero vector in its place, to the bit.
TEST(GridFields, VectorsThatAreNotFinite) {
  const ivec3 size(11, 10, 12);
  const GridPlacement placement = placements()[2].placement;
  VectorGrid whole = sampled(abc, size, placement);
  VectorGrid holed = whole;
  const ivec3 holes[] = {{4, 3, 5}, {0, 9, 11}, {10, 9, 0}};
  const glm::vec3 bad[] = {{0, float(nan), 0}, {std::numeric_limits<float>::infinity(), 0, 0}, glm::vec3(float(nan))};
  for (std::size_t h = 0; h < 3; h++) {
    const std::size_t at = std::size_t(holes[h].x + size.x * (holes[h].y + size.y * holes[h].z));
    whole.vectors[at] = glm::vec3(0);
    holed.vectors[at] = bad[h];
  }
  const std::vector<glm::vec3> points = points_in(size, placement, 6000, 11);
  for (const VectorReconstruction reconstruction : reconstructions) {
    const int reach = reconstruction == VectorReconstruction::tricubic ? 1 : 0;
    for (TestDevice& device : one_of_each()) {
      const std::string where = name_of(reconstruction) + ", " + device.label;
      const FlowSamples of_whole = Tracer(device.device, grid_flow(whole, reconstruction)).sample(points, 2);
      const FlowSamples of_holed = Tracer(device.device, grid_flow(holed, reconstruction)).sample(points, 2);
      std::size_t undefined = 0;
      for (std::size_t i = 0; i < points.size(); i++) {
        const dvec3 q = index_of(placement, dvec3(points[i]));
        const dvec3 within = q - glm::floor(q);
        if (std::min({within.x, within.y, within.z}) < 1e-4 || std::max({within.x, within.y, within.z}) > 1 - 1e-4)
          continue;  // rounding may take it to a neighbour
        const ivec3 cell(glm::floor(q));
        bool expected = false;
        for (const ivec3& hole : holes) {
          expected |= glm::all(glm::greaterThanEqual(hole, cell - reach)) &&
                      glm::all(glm::lessThanEqual(hole, cell + 1 + reach));
        }
        ASSERT_EQ(of_holed.status[i] == FlowStatus::undefined, expected) << where << ", point " << i;
        ASSERT_EQ(of_whole.status[i], FlowStatus::inside) << where;
        undefined += expected ? 1 : 0;
        if (expected) {
          EXPECT_TRUE(std::isnan(of_holed.value[i].x) && std::isnan(of_holed.jacobian[i][2].z) &&
                      std::isnan(of_holed.hessian[i][5].y))
              << where;
        } else {
          ASSERT_EQ(of_holed.value[i], of_whole.value[i]) << where;
          ASSERT_EQ(of_holed.jacobian[i], of_whole.jacobian[i]) << where;
          ASSERT_EQ(of_holed.hessian[i], of_whole.hessian[i]) << where;
        }
      }
      EXPECT_GT(undefined, 20u) << where;
    }
  }
}

TEST(GridFields, PointsOutsideAndOnTheBorder) {
  const ivec3 size(5, 4, 6);
  for (const Placed& placed : placements()) {
    const GridPlacement& placement = placed.placement;
    std::vector<glm::vec3> border, outside;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 600; i++) {
      dvec3 q = dvec3(uniform(random), uniform(random), uniform(random)) * dvec3(size - 1);
      if (i % 3 == 0) q = glm::round(q);  // nodes
      const int axis = i / 3 % 3;
      const bool upper = i % 2 == 0;
      q[axis] = upper ? size[axis] - 1 : 0;
      border.emplace_back(placement.origin + placement.axes * q);
      q[axis] += upper ? 0.25 : -0.25;
      outside.emplace_back(placement.origin + placement.axes * q);
    }
    const std::size_t near = outside.size();
    for (const double x : {1e6, -1e6, 1e30, -1e30, 3e38}) outside.emplace_back(float(x), float(-x), float(x));
    const std::size_t far = outside.size();
    outside.emplace_back(std::numeric_limits<float>::infinity(), 0, 0);
    outside.emplace_back(0, float(nan), 0);
    for (const VectorReconstruction reconstruction : reconstructions) {
      const VectorField flow = grid_flow(sampled(abc, size, placement), reconstruction);
      for (TestDevice& device : one_of_each()) {
        const std::string where = std::string(placed.name) + ", " + name_of(reconstruction) + ", " + device.label;
        const Tracer tracer(device.device, flow);
        for (const FlowStatus status : tracer.sample(border, 1).status) ASSERT_EQ(status, FlowStatus::inside) << where;
        const FlowSamples out = tracer.sample(outside, 2);
        for (std::size_t i = 0; i < outside.size(); i++) {
          if (i < far) {
            EXPECT_EQ(out.status[i], FlowStatus::domain) << where << ", point " << i << " of " << near;
          }
          EXPECT_NE(out.status[i], FlowStatus::inside) << where << ", point " << i;
          EXPECT_EQ(out.cell[i], -1) << where;
          EXPECT_TRUE(std::isnan(out.value[i].x) && std::isnan(out.jacobian[i][0].x) &&
                      std::isnan(out.hessian[i][5].z) && std::isnan(out.local[i].y))
              << where;
        }
      }
    }
  }
}

// At nodes both reconstructions give the vectors back: trilinear to the place's rounding, tricubic to that of the
// coefficients.
TEST(GridFields, NodesKeepTheirVectors) {
  const ivec3 size(8, 9, 7);
  const GridPlacement placement = placements()[0].placement;
  const VectorGrid grid = sampled(abc, size, placement);
  std::vector<glm::vec3> nodes;
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++) nodes.emplace_back(placement.origin + placement.axes * dvec3(i, j, k));
  for (const VectorReconstruction reconstruction : reconstructions) {
    const VectorField flow = grid_flow(grid, reconstruction);
    for (TestDevice& device : one_of_each()) {
      const FlowSamples samples = Tracer(device.device, flow).sample(nodes);
      double worst = 0;
      for (std::size_t i = 0; i < nodes.size(); i++) {
        ASSERT_EQ(samples.status[i], FlowStatus::inside) << device.label;
        worst = std::max(worst, double(glm::length(samples.value[i] - grid.vectors[i])));
      }
      // The field's slope is less than 4, coordinates are less than 4, and rounded once; vectors are less than 4 long.
      EXPECT_LT(worst, 16 * 4 * 0x1p-24) << name_of(reconstruction) << ", " << device.label;
    }
  }
}

// On OpenCL every number of lanes gives the same bits. Other devices may fuse other products.
TEST(GridFields, EveryDeviceGivesTheSame) {
  const ivec3 size(13, 11, 17);
  for (const Placed& placed : placements()) {
    const std::vector<glm::vec3> points = points_in(size, placed.placement, 1003, 23);
    for (const VectorReconstruction reconstruction : reconstructions) {
      const VectorField flow = grid_flow(sampled(abc, size, placed.placement), reconstruction);
      const TestDevice* first = nullptr;
      FlowSamples expected;
      for (TestDevice& device : test_devices()) {
        const std::string where = std::string(placed.name) + ", " + name_of(reconstruction) + ", " + device.label;
        const FlowSamples samples = Tracer(device.device, flow).sample(points, 2);
        if (!first) {
          first = &device;
          expected = samples;
          continue;
        }
        const bool same = device.name == first->name;
        for (std::size_t i = 0; i < points.size(); i++) {
          ASSERT_EQ(samples.status[i], expected.status[i]) << where;
          if (same) {
            ASSERT_EQ(samples.cell[i], expected.cell[i]) << where;
            ASSERT_EQ(samples.value[i], expected.value[i]) << where;
            ASSERT_EQ(samples.jacobian[i], expected.jacobian[i]) << where;
            ASSERT_EQ(samples.hessian[i], expected.hessian[i]) << where;
          } else {
            // As much as the affine fields above, whose vectors are as long.
            EXPECT_LT(glm::length(samples.value[i] - expected.value[i]), 16 * 4 * 0x1p-24) << where;
          }
        }
      }
    }
  }
}

void expect_refusal(const VectorGrid& grid, const std::vector<std::string>& words) {
  const std::string said = refusal(ErrorCode::input, [&] { grid_flow(grid); });
  for (const std::string& word : words) EXPECT_NE(said.find(word), std::string::npos) << said;
}

TEST(GridFields, InputIsChecked) {
  const VectorGrid good = sampled(abc, {2, 3, 4}, {});
  VectorGrid grid = good;
  grid.size.y = 1;
  expect_refusal(grid, {"2 x 1 x 4", "at least 2"});
  grid = good;
  grid.vectors.pop_back();
  expect_refusal(grid, {"24 nodes", "23 vectors"});
  grid = good;
  grid.placement.axes[1] = grid.placement.axes[0];
  expect_refusal(grid, {"plane"});
  grid = good;
  grid.placement.axes[2] = dvec3(0);
  expect_refusal(grid, {"axis 2", "zero"});
  grid = good;
  grid.placement.origin.x = nan;
  expect_refusal(grid, {"origin", "finite"});
}

TEST(GridFields, FactsAndBounds) {
  VectorGrid grid = sampled([](const dvec3& p) { return Jet{p, {}, {}}; }, {3, 4, 5}, spacing(1, 2, 0.5));
  const VectorField field = grid_flow(grid, VectorReconstruction::tricubic);
  EXPECT_EQ(field.kind(), "grid");
  EXPECT_EQ(field.bounds().lower, dvec3(0));
  EXPECT_EQ(field.bounds().upper, dvec3(2, 6, 2));
  EXPECT_NEAR(field.model().greatest_speed(), std::sqrt(4.0 + 36 + 4), 1e-12);
}

}  // namespace
}  // namespace smurf::test
