// Points in curvilinear blocks, on every device: the right cell, and place and vector in it, against a search through
// all cells in double precision; affine fields as they are, on cells of every bad shape; and lines across seams.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "flows/definition.hpp"
#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "numerics/parallel.hpp"
#include "smurf/flow.hpp"
#include "truth/flow/curvilinear.hpp"

namespace smurf::test {

KERNELS(trace_lines, sample_flow, vector_prefilter, vector_pad);

namespace {

// Nodes and points are rounded to floats once they are counted from the middle: half a unit in the last place of the
// half extent each, along each axis, and as much again in the map between them. Devices accept as much (and a half).
constexpr double rounding = 0x1p-23;
constexpr double accepted = 2 * rounding;

// Found on a grid of any form, for all points, and how many were so near to a face that either cell was right.
struct Score {
  std::size_t inside = 0, near_faces = 0, wrong = 0, between = 0;
  double worst_place = 0, worst_value = 0;  // of what is allowed
};

// Whether device `status`, `cell`, `local` and `value` are right for a point whose cells are `truths`.
void judge(const CellTruths& grid, const std::vector<CellTruth>& truths, const FlowSamples& samples, std::size_t row,
           double greatest, Score& score) {
  const double near = accepted * grid.size();
  // The first cell that contains the point for sure; a cell with a greater number is wrong.
  std::int64_t sure = std::numeric_limits<std::int64_t>::max();
  for (const CellTruth& truth : truths)
    if (truth.depth > near && !truth.only_between) sure = std::min(sure, truth.cell);
  const std::int64_t cell = samples.cell[row];
  const bool some_sure = sure != std::numeric_limits<std::int64_t>::max();
  if (samples.status[row] != FlowStatus::inside) {
    score.wrong += some_sure || samples.status[row] != FlowStatus::domain || cell != -1;
    return;
  }
  const CellTruth* found = nullptr;
  for (const CellTruth& truth : truths) {
    if (truth.cell != cell || (truth.only_between && some_sure)) continue;
    const auto off = [&](const CellTruth& t) { return glm::length(glm::dvec3(samples.local[row]) - t.local); };
    if (found == nullptr || found->only_between || off(truth) < off(*found)) found = &truth;
  }
  if (found == nullptr || cell > sure) {
    score.wrong++;
    return;
  }
  score.inside++;
  score.near_faces += std::abs(found->depth) <= near;
  score.between += found->only_between;
  // A place that is off by `near` along each axis.
  double value_allowed = 4 * rounding * greatest, value_error = 0;
  for (int axis = 0; axis < 3; axis++) {
    const double allowed = found->reach[axis] * near + 4 * rounding;
    const double error = std::abs(double(samples.local[row][axis]) - std::clamp(found->local[axis], 0.0, 1.0));
    score.worst_place = std::max(score.worst_place, error / allowed);
    const glm::dvec3 by = glm::abs(found->by_local[axis]);
    value_allowed += allowed * std::max({by.x, by.y, by.z});
  }
  const glm::dvec3 off = glm::abs(glm::dvec3(samples.value[row]) - found->value);
  value_error = std::max({off.x, off.y, off.z});
  score.worst_value = std::max(score.worst_value, value_error / value_allowed);
}

// Half the points anywhere in the box, and a little outside of it, half in cells chosen at random, which are smaller
// where more happens.
std::vector<glm::vec3> random_points(const CellTruths& grid, const Bounds& bounds, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-0.02, 1.02);
  std::vector<glm::vec3> points;
  for (std::size_t i = 0; i < count; i++) {
    const double x = unit(random), y = unit(random), z = unit(random);
    points.emplace_back(i % 2 == 0 ? glm::mix(bounds.lower, bounds.upper, glm::dvec3(x, y, z))
                                   : grid.random_place(random));
  }
  return points;
}

void check_location(const std::vector<CurvilinearBlock>& blocks, std::size_t count, const std::string& name) {
  const VectorField field = curvilinear_flow(blocks);
  const CellTruths grid(blocks);
  double greatest = 0;
  for (const CurvilinearBlock& block : blocks)
    for (const glm::vec3& vector : block.vectors) greatest = std::max(greatest, double(glm::length(vector)));
  const std::vector<glm::vec3> points = random_points(grid, field.bounds(), count, 7);
  std::vector<std::vector<CellTruth>> truths(points.size());
  parallel_for(points.size(), [&](std::size_t i) { truths[i] = grid.about(points[i], accepted * grid.size()); });
  for (const TestDevice& device : test_devices()) {
    const Tracer tracer(device.device, field);
    tracer.sample({points.data(), 16});
    const auto begin = std::chrono::steady_clock::now();
    const FlowSamples samples = tracer.sample(points);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    Score score;
    for (std::size_t i = 0; i < points.size(); i++) judge(grid, truths[i], samples, i, greatest, score);
    EXPECT_EQ(score.wrong, 0u) << name << " on " << device.label;
    EXPECT_LE(score.worst_place, 1) << name << " on " << device.label;
    EXPECT_LE(score.worst_value, 1) << name << " on " << device.label;
    EXPECT_GT(score.inside, points.size() / 3) << name << " on " << device.label;
    std::printf(
        "%s on %s: %zu points, %zu inside, %zu at faces, %zu between, place %.2f, value %.2f of what is allowed, "
        "%.3g points/s\n",
        name.c_str(), device.label.c_str(), points.size(), score.inside, score.near_faces, score.between,
        score.worst_place, score.worst_value, double(points.size()) / took.count());
  }
}

const glm::dmat3 affine_slope(0.5, -1.25, 0.75, 1.5, 0.25, -0.5, -0.75, 1.0, 2.0);
const glm::dvec3 affine_offset(0.5, 1, -2);
glm::dvec3 affine(const glm::dvec3& p) { return affine_slope * p + affine_offset; }

// A field that is affine stays so, whatever the cells: vectors to 2e-6 of the greatest. Derivatives are differences
// over edges of cells, at least `shortest` long, of vectors and places that are rounded at both ends: two roundings
// each, and three times as much where edges stand askew.
void check_affine(const std::vector<CurvilinearBlock>& blocks, const std::vector<glm::vec3>& points, double shortest,
                  const std::string& name) {
  const VectorField field = curvilinear_flow(blocks);
  double greatest = 0;
  for (const CurvilinearBlock& block : blocks)
    for (const glm::vec3& vector : block.vectors) greatest = std::max(greatest, double(glm::length(vector)));
  const Bounds bounds = field.bounds();
  const double half = 0.5 * glm::length(bounds.upper - bounds.lower), steepest = glm::length(affine_slope[2]);
  const double slope_allowed = 3 * rounding * (greatest + steepest * half) / shortest;
  for (const TestDevice& device : test_devices()) {
    const Tracer tracer(device.device, field);
    const FlowSamples samples = tracer.sample(points, 1);
    double worst = 0, worst_slope = 0;
    std::size_t lost = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      if (samples.status[i] != FlowStatus::inside) {
        lost++;
        continue;
      }
      worst = std::max(worst, glm::length(glm::dvec3(samples.value[i]) - affine(glm::dvec3(points[i]))));
      for (int column = 0; column < 3; column++)
        worst_slope =
            std::max(worst_slope, glm::length(glm::dvec3(samples.jacobian[i][column]) - affine_slope[column]));
    }
    EXPECT_EQ(lost, 0u) << name << " on " << device.label;
    EXPECT_LE(worst, 2e-6 * greatest) << name << " on " << device.label;
    EXPECT_LE(worst_slope, slope_allowed) << name << " on " << device.label;
    std::printf("%s on %s: vectors %.2f, derivatives %.2f of what is allowed\n", name.c_str(), device.label.c_str(),
                worst / (2e-6 * greatest), worst_slope / slope_allowed);
  }
}

glm::dvec3 waves(const glm::dvec3& p) {
  return {std::sin(3 * p.x) + p.y, std::cos(2 * p.y) + p.z, p.x * p.y + 0.5 * std::sin(p.z)};
}

std::vector<glm::vec3> mapped_points(const PlaceOf& place, std::size_t count, double margin, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(margin, 1 - margin);
  std::vector<glm::vec3> points;
  for (std::size_t i = 0; i < count; i++) {
    const double x = unit(random), y = unit(random), z = unit(random);
    points.emplace_back(place({x, y, z}));
  }
  return points;
}

glm::dvec3 sheared(const glm::dvec3& u) {
  return {100 + 3 * u.x + 1.5 * u.y - 0.7 * u.z, -20 + 2 * u.y + 0.4 * u.z, 5 + 0.5 * u.x + 1.2 * u.z};
}

// Turned about z by up to a radian, and wider at the top.
glm::dvec3 twisted(const glm::dvec3& u) {
  const double angle = u.z, wide = 1 + 0.5 * u.z;
  const glm::dvec2 p = wide * glm::dvec2(u.x - 0.5, u.y - 0.5);
  return {p.x * std::cos(angle) - p.y * std::sin(angle), p.x * std::sin(angle) + p.y * std::cos(angle), 2 * u.z};
}

glm::dvec3 mirrored(const glm::dvec3& u) {
  const glm::dvec3 p = twisted(u);
  return {-p.x, p.y, p.z};
}

// About the axis from radius `inner` to 2, once around.
PlaceOf ring(double inner) {
  return [inner](const glm::dvec3& u) {
    const double angle = 2 * std::numbers::pi * u.x, radius = inner + (2 - inner) * u.y;
    return glm::dvec3(radius * std::cos(angle), radius * std::sin(angle), u.z);
  };
}

// A twisted box of which one node inside is pushed through the cells beside it.
CurvilinearBlock inverted_block() {
  CurvilinearBlock block = block_of({7, 6, 8}, twisted, affine);
  const std::size_t node = 3 + 7 * (2 + 6 * 4);
  block.points[node] += 1.6 * (block.points[node + 1] - block.points[node]);
  block.vectors[node] = glm::vec3(affine(block.points[node]));
  return block;
}

TEST(Location, Combustor) {
  if (!has_shared_data("vectors/combxyz.bin")) GTEST_SKIP();
  const CurvilinearBlock block =
      read_plot3d_block(shared_data("vectors/combxyz.bin"), shared_data("vectors/combq.bin"));
  check_location({block}, std::size_t(20000) * std::size_t(density()) / sanitized_part, "combustor");
}

TEST(Location, CylinderWithSeam) {
  if (!has_shared_data("vectors/cylinderxyz.bin")) GTEST_SKIP();
  const CurvilinearBlock block =
      read_plot3d_block(shared_data("vectors/cylinderxyz.bin"), shared_data("vectors/cylinderq.bin"));
  check_location({block}, std::size_t(20000) * std::size_t(density()) / sanitized_part, "cylinder");
}

TEST(Location, CellsOfEveryShape) {
  const std::size_t count = std::size_t(4000) * std::size_t(density()) / sanitized_part;
  check_location({block_of({9, 7, 8}, sheared, waves)}, count, "sheared");
  check_location({block_of({9, 7, 8}, twisted, waves)}, count, "twisted");
  check_location({block_of({9, 7, 8}, mirrored, waves)}, count, "left-handed");
  check_location({block_of({17, 6, 4}, ring(0.5), waves)}, count, "ring");
  check_location({block_of({17, 6, 4}, ring(0), waves)}, count, "collapsed edge");
  check_location({inverted_block()}, count, "inverted");
  const PlaceOf beside = [](const glm::dvec3& u) { return twisted(u) + glm::dvec3(0.3, 0.1, 0.4); };
  check_location({block_of({9, 7, 8}, twisted, waves), block_of({5, 6, 7}, beside, waves)}, count, "overlap");
}

// Along each axis nodes stand a thousand times closer at one end than at the other.
TEST(Location, UnevenAxes) {
  const auto axis = [](int nodes, double grow) {
    std::vector<double> places{0};
    double step = 1;
    for (int i = 1; i < nodes; i++, step *= grow) places.push_back(places.back() + step);
    for (double& place : places) place /= places.back();
    return places;
  };
  const std::array<std::vector<double>, 3> axes{axis(30, 1.27), axis(20, 1.4), axis(25, 1 / 1.3)};
  CurvilinearBlock block;
  block.size = {30, 20, 25};
  for (const double z : axes[2])
    for (const double y : axes[1])
      for (const double x : axes[0]) {
        block.points.push_back({x, y, z});
        block.vectors.push_back(glm::vec3(affine({x, y, z})));
      }
  check_location({block}, std::size_t(6000) / sanitized_part, "uneven axes");
  // The same as a rectilinear field.
  const VectorField field = rectilinear_flow(axes, block.vectors);
  const CellTruths grid({block});
  const std::vector<glm::vec3> points = random_points(grid, field.bounds(), 2000, 3);
  for (const TestDevice& device : test_devices()) {
    const FlowSamples a = Tracer(device.device, field).sample(points);
    const FlowSamples b = Tracer(device.device, curvilinear_flow({block})).sample(points);
    EXPECT_EQ(a.cell, b.cell) << device.label;
    EXPECT_EQ(a.status, b.status) << device.label;
  }
}

TEST(Location, AffineFieldsStayAffine) {
  const std::size_t count = 2000 / sanitized_part;
  check_affine({block_of({9, 7, 8}, sheared, affine)}, mapped_points(sheared, count, 1e-4, 1), 0.2, "sheared");
  // Faces of the hull are curved, and chords of the cells' faces stay within them by up to 2 % here.
  check_affine({block_of({9, 7, 8}, twisted, affine)}, mapped_points(twisted, count, 0.03, 2), 0.12, "twisted");
  check_affine({block_of({9, 7, 8}, mirrored, affine)}, mapped_points(mirrored, count, 0.03, 3), 0.12, "left-handed");
  check_affine({inverted_block()}, mapped_points(twisted, count, 0.06, 4), 0.05, "inverted");
  check_affine({block_of({33, 6, 4}, ring(0.5), affine)}, mapped_points(ring(0.6), count, 0.01, 5), 0.09, "ring");
  check_affine({block_of({33, 6, 4}, ring(0), affine)}, mapped_points(ring(1e-3), count, 0.01, 6), 0.02,
               "collapsed edge");
}

// Vectors and derivatives where the reference has them, too, in the same cell.
void check_against_reference(const std::vector<CurvilinearBlock>& blocks, VectorReconstruction reconstruction,
                             const std::vector<glm::vec3>& points, double shortest, const std::string& name) {
  const VectorField field = curvilinear_flow(blocks, reconstruction);
  const int derivatives = reconstruction == VectorReconstruction::tricubic ? 2 : 1;
  const FlowSamples truth = Tracer(reference_device(), field).sample(points, derivatives);
  double greatest = field.model().greatest_speed(), steepest = 0;
  for (const glm::mat3& slope : truth.jacobian)
    for (int column = 0; column < 3; column++)
      if (std::isfinite(slope[column].x)) steepest = std::max(steepest, double(glm::length(slope[column])));
  const Bounds bounds = field.bounds();
  // Places and vectors of nodes are rounded, and differ by as little as the shortest edge of a cell.
  const double noise = rounding * (greatest + steepest * 0.5 * glm::length(bounds.upper - bounds.lower));
  for (const TestDevice& device : test_devices()) {
    const FlowSamples samples = Tracer(device.device, field).sample(points, derivatives);
    double worst[3] = {0, 0, 0};
    std::size_t compared = 0, other_cells = 0, other_status = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      if (samples.status[i] != truth.status[i]) {
        other_status++;
        continue;
      }
      if (samples.status[i] != FlowStatus::inside) continue;
      const auto off = [](const glm::vec3& a, const glm::vec3& b) {
        return glm::length(glm::dvec3(a) - glm::dvec3(b));
      };
      compared++;
      worst[0] = std::max(worst[0], off(samples.value[i], truth.value[i]) / noise);
      // At a face, where trilinear derivatives jump.
      if (samples.cell[i] != truth.cell[i]) {
        other_cells++;
        continue;
      }
      for (int column = 0; column < 3; column++)
        worst[1] = std::max(worst[1], off(samples.jacobian[i][column], truth.jacobian[i][column]) * shortest / noise);
      if (derivatives < 2) continue;
      for (std::size_t second = 0; second < 6; second++)
        worst[2] =
            std::max(worst[2], off(samples.hessian[i][second], truth.hessian[i][second]) * shortest * shortest / noise);
    }
    std::printf("%s on %s: %zu compared, vectors %.2f, derivatives %.2f, second derivatives %.2f of rounding\n",
                name.c_str(), device.label.c_str(), compared, worst[0], worst[1], worst[2]);
    EXPECT_EQ(other_status, 0u) << name << " on " << device.label;
    EXPECT_LE(other_cells, points.size() / 500) << name << " on " << device.label;
    EXPECT_GT(compared, points.size() / 2) << name << " on " << device.label;
    // Sums of 8 and 64 products, and the inverse of a Jacobian of edges that stand askew.
    EXPECT_LE(worst[0], 4) << name << " on " << device.label;
    EXPECT_LE(worst[1], 16) << name << " on " << device.label;
    EXPECT_LE(worst[2], 64) << name << " on " << device.label;
  }
}

TEST(Location, DerivativesWithinTrilinearCells) {
  const std::size_t count = 2000 / sanitized_part;
  constexpr auto trilinear = VectorReconstruction::trilinear;
  check_against_reference({block_of({9, 7, 8}, twisted, waves)}, trilinear, mapped_points(twisted, count, 0.03, 12),
                          0.12, "twisted");
  check_against_reference({block_of({33, 6, 4}, ring(0.5), waves)}, trilinear,
                          mapped_points(ring(0.6), count, 0.01, 13), 0.09, "ring");
}

// Splines of places and vectors. On a ring they are periodic, and reach out to the circle where cells end at chords.
TEST(Location, TricubicFields) {
  const std::size_t count = 2000 / sanitized_part;
  constexpr auto tricubic = VectorReconstruction::tricubic;
  const CurvilinearBlock round = block_of({17, 6, 4}, ring(0.5), waves);
  check_against_reference({block_of({9, 7, 8}, sheared, waves)}, tricubic, mapped_points(sheared, count, -0.1, 21), 0.2,
                          "tricubic sheared");
  check_against_reference({block_of({9, 7, 8}, twisted, waves)}, tricubic, mapped_points(twisted, count, -0.1, 22),
                          0.12, "tricubic twisted");
  check_against_reference({round}, tricubic, mapped_points(ring(0.5), count, 1e-3, 23), 0.12, "tricubic ring");
  check_against_reference({block_of({9, 7, 8}, twisted, waves), block_of({17, 6, 4}, ring(2), waves), round}, tricubic,
                          mapped_points(ring(0.3), count, -0.1, 24), 0.12, "tricubic blocks");
  std::vector<glm::vec3> rim;
  for (int i = 0; i < 64; i++) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / 64;
    rim.emplace_back(1.999 * std::cos(angle), 1.999 * std::sin(angle), 0.5);
  }
  for (const TestDevice& device : test_devices()) {
    const FlowSamples chords = Tracer(device.device, curvilinear_flow({round})).sample(rim);
    const FlowSamples arcs = Tracer(device.device, curvilinear_flow({round}, tricubic)).sample(rim);
    EXPECT_EQ(std::ranges::count(chords.status, FlowStatus::domain), 64) << device.label;
    EXPECT_EQ(std::ranges::count(arcs.status, FlowStatus::inside), 64) << device.label;
  }
}

// An affine field on a sheared block is one of splines, too, with derivatives that are known. A hole in a vector makes
// undefined what is made of it.
TEST(Location, TricubicAffineFieldsAndHoles) {
  CurvilinearBlock block = block_of({9, 7, 8}, sheared, affine);
  const std::vector<glm::vec3> points = mapped_points(sheared, 1000, 1e-4, 31);
  for (const TestDevice& device : test_devices()) {
    const Tracer tracer(device.device, curvilinear_flow({block}, VectorReconstruction::tricubic));
    const FlowSamples samples = tracer.sample(points, 2);
    double worst = 0, slope = 0, bend = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      ASSERT_EQ(samples.status[i], FlowStatus::inside) << device.label;
      worst = std::max(worst, glm::length(glm::dvec3(samples.value[i]) - affine(glm::dvec3(points[i]))));
      for (int column = 0; column < 3; column++)
        slope = std::max(slope, glm::length(glm::dvec3(samples.jacobian[i][column]) - affine_slope[column]));
      for (const glm::vec3& second : samples.hessian[i]) bend = std::max(bend, double(glm::length(second)));
    }
    // Vectors are up to 230 long: two roundings, over edges of 0.2, and over their square.
    EXPECT_LE(worst, 4 * rounding * 230) << device.label;
    EXPECT_LE(slope, 8 * rounding * 230 / 0.2) << device.label;
    EXPECT_LE(bend, 16 * rounding * 230 / 0.04) << device.label;
  }
  block.vectors[4 + 9 * (3 + 7 * 3)].x = std::numeric_limits<float>::quiet_NaN();
  const std::vector<glm::vec3> about{sheared({4.5 / 8, 3.5 / 6, 3.5 / 7}), sheared({5.5 / 8, 4.5 / 6, 4.5 / 7}),
                                     sheared({6.5 / 8, 3.5 / 6, 3.5 / 7})};
  for (const TestDevice& device : test_devices()) {
    using enum FlowStatus;
    const auto status = [&](VectorReconstruction reconstruction) {
      return Tracer(device.device, curvilinear_flow({block}, reconstruction)).sample(about).status;
    };
    EXPECT_EQ(status(VectorReconstruction::trilinear), (std::vector<FlowStatus>{undefined, inside, inside}));
    EXPECT_EQ(status(VectorReconstruction::tricubic), (std::vector<FlowStatus>{undefined, undefined, inside}));
  }
}

// Blanked nodes blank the cells about them; where another block has a cell, that counts.
TEST(Location, BlankedAndUndefinedCells) {
  const auto box = [](const glm::dvec3& u) { return 4.0 * u; };
  CurvilinearBlock block = block_of({5, 5, 5}, box, affine);
  block.blanked.assign(block.points.size(), 0);
  block.blanked[1 + 5 * (1 + 5 * 1)] = 1;
  block.vectors[1 + 5 * (1 + 5 * 1)].x = std::numeric_limits<float>::quiet_NaN();
  block.vectors[4 + 5 * (4 + 5 * 4)].y = std::numeric_limits<float>::infinity();
  const std::vector<glm::vec3> points{{0.5f, 0.5f, 0.5f}, {1.5f, 1.5f, 1.5f}, {2.5f, 1.5f, 1.5f}, {3.5f, 3.5f, 3.5f},
                                      {2.5f, 3.5f, 3.5f}, {5, 1, 1},          {-1e-3f, 1, 1},     {1e30f, 0, 0}};
  const std::vector<FlowStatus> statuses{FlowStatus::blanked,   FlowStatus::blanked, FlowStatus::inside,
                                         FlowStatus::undefined, FlowStatus::inside,  FlowStatus::domain,
                                         FlowStatus::domain,    FlowStatus::domain};
  const std::vector<std::int32_t> cells{0, 1 + 4 + 16, 2 + 4 + 16, 3 + 12 + 48, 2 + 12 + 48, -1, -1, -1};
  const auto patch = [](const glm::dvec3& u) { return 1.25 + 0.5 * u; };
  for (const TestDevice& device : test_devices()) {
    const FlowSamples samples = Tracer(device.device, curvilinear_flow({block})).sample(points, 1);
    EXPECT_EQ(samples.status, statuses) << device.label;
    EXPECT_EQ(samples.cell, cells) << device.label;
    EXPECT_TRUE(std::isnan(samples.value[0].x) && std::isnan(samples.value[3].x)) << device.label;
    const Tracer two(device.device, curvilinear_flow({block, block_of({3, 3, 3}, patch, affine)}));
    const FlowSamples covered = two.sample(points);
    EXPECT_EQ(covered.status[1], FlowStatus::inside) << device.label;
    EXPECT_EQ(covered.cell[1], 64) << device.label;
    EXPECT_EQ(covered.status[0], FlowStatus::blanked) << device.label;
    EXPECT_EQ(covered.cell[2], 2 + 4 + 16) << device.label;
  }
}

// A place that more cells hold belongs to the first block, and there is one beyond it only outside of that.
TEST(Location, OverlappingBlocks) {
  const auto left = [](const glm::dvec3& u) { return 2.0 * u; };
  const auto right = [](const glm::dvec3& u) { return glm::dvec3(1, 0, 0) + 2.0 * u; };
  const auto one = [](const glm::dvec3&) { return glm::dvec3(1, 0, 0); };
  const auto two = [](const glm::dvec3&) { return glm::dvec3(2, 0, 0); };
  const VectorField field = curvilinear_flow({block_of({3, 3, 3}, left, one), block_of({3, 3, 3}, right, two)});
  const std::vector<glm::vec3> points{{0.5f, 0.5f, 0.5f}, {1.5f, 0.5f, 0.5f}, {2.5f, 0.5f, 0.5f}};
  for (const TestDevice& device : test_devices()) {
    const Tracer tracer(device.device, field);
    const FlowSamples samples = tracer.sample(points);
    EXPECT_EQ(samples.cell, (std::vector<std::int32_t>{0, 1, 8 + 1})) << device.label;
    EXPECT_EQ(samples.value[1].x, 1) << device.label;
    EXPECT_EQ(samples.value[2].x, 2) << device.label;
    // From 0.5 at speed 1 to 2, and on at speed 2 to the end at 3.
    const Streamlines lines = tracer.trace({.positions = {{0.5, 0.5, 0.5}}}, {.time = 10});
    EXPECT_EQ(lines.end[0], FlowStatus::domain) << device.label;
    EXPECT_NEAR(lines.positions.back().x, 3, 1e-5) << device.label;
    EXPECT_NEAR(lines.times.back(), 2, 1e-3) << device.label;
  }
}

// A rotation about the axis of a ring, which goes through the seam twice and comes back to where it began. The field is
// affine, so that cells have no part in the error, and a line keeps its radius.
TEST(Location, LinesCrossSeams) {
  const auto rotation = [](const glm::dvec3& p) { return glm::dvec3(-p.y, p.x, 0); };
  const VectorField field = curvilinear_flow({block_of({33, 6, 4}, ring(0.5), rotation)});
  FlowSeeds seeds;
  for (int i = 0; i < 40; i++) seeds.positions.emplace_back(0.6 + 0.03 * i, 0.1, 0.01 + 0.024 * i);
  for (const TestDevice& device : test_devices()) {
    const Streamlines lines =
        Tracer(device.device, field).trace(seeds, {.time = 4 * std::numbers::pi, .tolerance = 1e-6});
    ASSERT_EQ(lines.size(), seeds.positions.size());
    double worst = 0;
    for (std::size_t i = 0; i < lines.size(); i++) {
      EXPECT_EQ(lines.end[i], FlowStatus::time) << device.label;
      worst = std::max(worst, glm::length(glm::dvec3(lines.positions[lines.offsets[i + 1] - 1]) - seeds.positions[i]));
    }
    // A tolerance of 1e-6 a step, and some 60 steps.
    EXPECT_LT(worst, 6e-5) << device.label;
  }
}

}  // namespace
}  // namespace smurf::test
