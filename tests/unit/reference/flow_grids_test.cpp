// The reference for flows on grids, regular and curvilinear: against fields that the reconstruction reproduces, an
// integrator of small steps, and closed forms with kinks; where points lie; statuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "flows/kinds.hpp"
#include "reference/flow/extrapolation.hpp"
#include "reference/flow/flow.hpp"
#include "reference/flow/line.hpp"
#include "reference/flow/variation.hpp"
#include "truth/flow/flows.hpp"

namespace smurf::test {
namespace {

using glm::dvec3;
using glm::ivec3;

constexpr VectorReconstruction reconstructions[] = {VectorReconstruction::trilinear, VectorReconstruction::tricubic};

// Nodes at (i, j, k) steps from -extent/2.
template <class Field>
VectorGrid grid_of(const ivec3& size, const glm::dmat3& axes, const Field& field) {
  VectorGrid grid{size, {axes, axes * (-0.5 * dvec3(size - 1))}, {}};
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++)
        grid.vectors.push_back(glm::vec3(field(grid.placement.origin + axes * dvec3(i, j, k))));
  return grid;
}

// A helix whose values at nodes that are small multiples of a power of two are floats.
FlowTruth helix() { return linear_flow("helix", {0, 1, 0, -1, 0, 0, 0, 0, 0}, {0, 0, 0.25}); }

TEST(ReferenceFlowOnGrids, LinearFieldsAreReproduced) {
  const FlowTruth truth = helix();
  // The steps along the axes are no right angles.
  const glm::dmat3 axes(0.25, 0, 0, 0.125, 0.25, 0, 0, -0.125, 0.25);
  const dvec3 tangent(0.5, 0.25, 1), second(1, -0.5, 0.25);
  for (const VectorReconstruction reconstruction : reconstructions) {
    const auto flow = refer(grid_flow(grid_of({25, 17, 33}, axes, truth.value), reconstruction).model());
    for (const dvec3& seed : truth.seeds) {
      const LineRequest request{.time = 2, .interval = 0.5};
      const ReferenceLine line = trace_line(*flow, seed, request);
      ASSERT_EQ(line.end, FlowStatus::time);
      ASSERT_EQ(line.points.size(), 5u);
      const LineVariation variation = vary_line(*flow, line, request, tangent, second, 2);
      for (std::size_t i = 0; i < line.points.size(); i++) {
        const FlowPosition known = truth.at(seed, tangent, second, line.points[i].time);
        EXPECT_LT(glm::length(line.points[i].position - known.position), 1e-11);
        // Differences over a quarter of a cell, 1/16, and less; roundings of 1e-15 at a time.
        EXPECT_LT(glm::length(variation.first[i] - known.first), 1e-10);
        EXPECT_LT(glm::length(variation.second[i] - known.second), 1e-8);
      }
    }
  }
}

TEST(ReferenceFlowOnGrids, KinksAtFaces) {
  // y' = |x|, which trilinear interpolation reproduces where nodes stand at x = 0: y = x |x| / 2.
  const auto flow = refer(grid_flow(grid_of({17, 17, 9}, glm::dmat3(0.25), [](const dvec3& p) {
                            return dvec3(1, std::abs(p.x), 0);
                          })).model());
  const ReferenceLine line = trace_line(*flow, {-1.1, 0.3, 0.1}, {.time = 2.5, .interval = 0.1});
  ASSERT_EQ(line.points.size(), 26u);
  for (const LinePoint& point : line.points) {
    const double x = -1.1 + point.time;
    EXPECT_LT(glm::length(point.position - dvec3(x, 0.3 + 0.5 * (x * std::abs(x) + 1.21), 0.1)), 1e-12);
  }
}

// Trilinear interpolation once more, and small steps of the classic method.
dvec3 slow_line(const VectorGrid& grid, dvec3 x, double time, int steps) {
  const glm::dmat3 to_index = glm::inverse(grid.placement.axes);
  const auto value = [&](const dvec3& p) {
    const dvec3 q = to_index * (p - grid.placement.origin);
    const ivec3 cell = glm::clamp(ivec3(glm::floor(q)), ivec3(0), grid.size - 2);
    const dvec3 t = q - dvec3(cell);
    const auto node = [&](int i, int j, int k) {
      return dvec3(grid.vectors[std::size_t(cell.x + i + grid.size.x * (cell.y + j + grid.size.y * (cell.z + k)))]);
    };
    const auto row = [&](int j, int k) { return glm::mix(node(0, j, k), node(1, j, k), t.x); };
    return glm::mix(glm::mix(row(0, 0), row(1, 0), t.y), glm::mix(row(0, 1), row(1, 1), t.y), t.z);
  };
  const double h = time / steps;
  for (int i = 0; i < steps; i++) {
    const dvec3 a = value(x), b = value(x + 0.5 * h * a), c = value(x + 0.5 * h * b), d = value(x + h * c);
    x += h / 6 * (a + 2.0 * b + 2.0 * c + d);
  }
  return x;
}

TEST(ReferenceFlowOnGrids, RandomVectorsBySmallSteps) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> any(-1, 1);
  VectorGrid grid = grid_of({9, 8, 7}, glm::dmat3(0.5), [](const dvec3&) { return dvec3(0); });
  for (glm::vec3& v : grid.vectors) v = {any(random), any(random), any(random)};
  const auto flow = refer(grid_flow(grid).model());
  int whole = 0;
  for (int i = 0; i < 12; i++) {
    const dvec3 seed(any(random), any(random), any(random));
    const ReferenceLine line = trace_line(*flow, seed, {.time = 2});
    if (line.end != FlowStatus::time) continue;
    whole++;
    // Two runs tell what the small steps are worth: their error at each face goes with the square of a step.
    const dvec3 coarse = slow_line(grid, seed, 2, 20000), fine = slow_line(grid, seed, 2, 80000);
    const double doubt = glm::length(coarse - fine);
    ASSERT_LT(doubt, 1e-7);
    EXPECT_LT(glm::length(line.points.back().position - fine), doubt + 1e-9);
  }
  EXPECT_GE(whole, 8);
}

TEST(ReferenceFlowOnGrids, TricubicIsASmoothInterpolant) {
  const auto field = [](const dvec3& p) {
    return dvec3(std::sin(p.x) * std::cos(p.y), std::cos(2 * p.z) + p.x, std::exp(0.3 * p.y) * std::sin(p.z));
  };
  const VectorGrid grid = grid_of({11, 9, 10}, glm::dmat3(0.25), field);
  const auto flow = refer(grid_flow(grid, VectorReconstruction::tricubic).model());
  const auto node = [&](const ivec3& p) { return grid.placement.origin + grid.placement.axes * dvec3(p); };
  for (const ivec3& p : {ivec3(0, 0, 0), ivec3(10, 8, 9), ivec3(5, 4, 3), ivec3(0, 3, 9)}) {
    const dvec3 given(grid.vectors[std::size_t(p.x + 11 * (p.y + 9 * p.z))]);
    EXPECT_LT(glm::length(flow->at(node(p), 0).vector - given), 1e-14);
  }
  // From both sides of a face.
  const dvec3 face = node({5, 4, 3}) + dvec3(0, 0.1, 0.03);
  const ReferencePlace left = flow->find(face - dvec3(1e-9, 0, 0), 0), right = flow->find(face + dvec3(1e-9, 0, 0), 0);
  ASSERT_NE(left.piece, right.piece);
  const glm::dmat3 a = flow->jacobian(left, face), b = flow->jacobian(right, face);
  const std::array<dvec3, 6> c = flow->hessian(left, face), d = flow->hessian(right, face);
  for (int k = 0; k < 3; k++) EXPECT_LT(glm::length(a[k] - b[k]), 1e-10);
  for (std::size_t k = 0; k < 6; k++) EXPECT_LT(glm::length(c[k] - d[k]), 1e-7);
  // Natural ends.
  const dvec3 border = node({10, 4, 3}) + dvec3(0, 0.1, 0.03);
  EXPECT_LT(glm::length(flow->hessian(flow->find(border, 0), border)[0]), 1e-8);
  // Of fourth order where the ends are far away.
  const auto error = [&](int cells) {
    const auto fine = refer(
        grid_flow(grid_of(ivec3(cells + 1), glm::dmat3(6.0 / cells), field), VectorReconstruction::tricubic).model());
    double most = 0;
    for (int i = 0; i < 60; i++) {
      const dvec3 p = 0.4 * dvec3(std::sin(1.3 * i), std::cos(0.7 * i), std::sin(2.1 * i));
      most = std::max(most, glm::length(fine->at(p, 0).vector - field(p)));
    }
    return most;
  };
  EXPECT_NEAR(std::log2(error(16) / error(32)), 4, 0.6);
}

TEST(ReferenceFlowOnGrids, WhereNothingIsDefined) {
  VectorGrid grid = grid_of({9, 5, 5}, glm::dmat3(0.5), [](const dvec3&) { return dvec3(1, 0, 0); });
  grid.vectors[std::size_t(6 + 9 * (2 + 5 * 2))].y = std::nanf("");  // the node at (1, 0, 0)
  for (const VectorReconstruction reconstruction : reconstructions) {
    const bool tricubic = reconstruction == VectorReconstruction::tricubic;
    const auto flow = refer(grid_flow(grid, reconstruction).model());
    // Cells it is a corner of begin at x = 1/2; of 4³ nodes those that begin at 0.
    const ReferenceLine line = trace_line(*flow, {-1.9, 0.1, 0.1}, {.time = 10});
    EXPECT_EQ(line.end, FlowStatus::undefined);
    EXPECT_NEAR(line.points.back().position.x, tricubic ? 0 : 0.5, 1e-10);
    EXPECT_EQ(trace_line(*flow, {0.7, 0.1, 0.1}, {.time = 1}).end, FlowStatus::undefined);
    const ReferenceLine back = trace_line(*flow, {-1.9, 0.1, 0.1}, {.time = -10});
    EXPECT_EQ(back.end, FlowStatus::domain);
    EXPECT_NEAR(back.points.back().position.x, -2, 1e-12);
    EXPECT_EQ(flow->find({0, 1.001, 0}, 1e-4).status, FlowStatus::domain);
    EXPECT_EQ(flow->find({-1, 1.00005, 0}, 1e-4).status, FlowStatus::inside);
  }
}

// An O-grid about the z axis, twisted along it, of radii 1 to 3, whose nodes are multiples of 1/4096, so that linear
// fields are floats there. The seam's planes of nodes coincide.
CurvilinearBlock ring(const ivec3& size, const std::function<dvec3(const dvec3&)>& field) {
  CurvilinearBlock block{size, {}, {}, {}};
  for (int k = 0; k < size.z; k++) {
    for (int j = 0; j < size.y; j++) {
      for (int i = 0; i < size.x; i++) {
        const double s = double(j) / (size.y - 1), z = -1 + 2.0 * k / (size.z - 1), r = 1 + s * (1 + s);
        const double angle = 2 * 3.14159265358979323846 * (i % (size.x - 1)) / (size.x - 1) + 0.4 * z;
        const dvec3 p = glm::round(4096.0 * dvec3(r * std::cos(angle), r * std::sin(angle), z + 0.1 * s)) / 4096.0;
        block.points.push_back(p);
        block.vectors.push_back(glm::vec3(field(p)));
      }
    }
  }
  return block;
}

TEST(ReferenceFlowOnGrids, LinearFieldsOnARing) {
  const FlowTruth truth = helix();
  for (const VectorReconstruction reconstruction : reconstructions) {
    const auto flow = refer(curvilinear_flow({ring({25, 9, 9}, truth.value)}, reconstruction).model());
    for (const dvec3& seed : {dvec3(1.5, 0, -0.6), dvec3(-2, 0.3, -0.7), dvec3(0.2, -2.4, 0)}) {
      // Across the seam, which lies near the x axis, in three cases of four.
      const ReferenceLine line = trace_line(*flow, seed, {.time = 3, .interval = 0.25});
      ASSERT_EQ(line.end, FlowStatus::time);
      for (const LinePoint& point : line.points)
        EXPECT_LT(glm::length(point.position - truth.at(seed, dvec3(0), dvec3(0), point.time).position), 1e-10);
    }
  }
}

TEST(ReferenceFlowOnGrids, PlacesInCells) {
  const CurvilinearBlock block = ring({25, 9, 9}, [](const dvec3& p) { return p; });
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(0, 1);
  for (const VectorReconstruction reconstruction : reconstructions) {
    const auto flow = refer(curvilinear_flow({block}, reconstruction).model());
    for (int n = 0; n < 200; n++) {
      const std::int32_t cell = std::int32_t(any(random) * 24 * 8 * 8);
      const dvec3 local(any(random), any(random), any(random));
      // The vectors are the places, so that a place is the value there.
      const dvec3 point = flow->value(cell, dvec3(0), local);
      const ReferencePlace found = flow->find(point, 0);
      EXPECT_EQ(found.status, FlowStatus::inside);
      EXPECT_EQ(found.piece, cell);
      // The cells' sizes are 0.1 and more.
      EXPECT_LT(glm::length(found.local - local), 1e-12);
    }
    EXPECT_EQ(flow->find({0, 0, 0}, 0).status, FlowStatus::domain);
    EXPECT_EQ(flow->find({0, 3.3, 0}, 0).status, FlowStatus::domain);
  }
}

TEST(ReferenceFlowOnGrids, BlankedCellsAndBlocksThatOverlap) {
  // The second block is the first, moved by a quarter along x.
  const auto box = [](double shift, const glm::vec3& vector) {
    CurvilinearBlock block{{5, 3, 3}, {}, {}, {}};
    for (int k = 0; k < 3; k++)
      for (int j = 0; j < 3; j++)
        for (int i = 0; i < 5; i++) {
          block.points.push_back(dvec3(shift + 0.5 * i, 0.5 * j, 0.5 * k));
          block.vectors.push_back(vector);
        }
    return block;
  };
  CurvilinearBlock first = box(0, {1, 0, 0});
  const CurvilinearBlock second = box(1.25, {2, 0, 0});
  const auto both = refer(curvilinear_flow({first, second}).model());
  EXPECT_EQ(both->at({1.6, 0.1, 0.1}, 0).vector.x, 1);
  EXPECT_EQ(both->at({2.1, 0.1, 0.1}, 0).vector.x, 2);
  EXPECT_EQ(both->find({2.1, 0.1, 0.1}, 0).piece, 16 + 1);
  const ReferenceLine through = trace_line(*both, {0.5, 0.1, 0.1}, {.time = 10});
  EXPECT_EQ(through.end, FlowStatus::domain);
  // 1.5 at speed 1, up to x = 2, and 1.25 at speed 2.
  EXPECT_NEAR(through.points.back().time, 1.5 + 0.625, 1e-9);

  first.blanked.assign(first.points.size(), 0);
  first.blanked[4] = 1;  // of the corner at x = 2
  const auto alone = refer(curvilinear_flow({first}).model());
  const ReferenceLine line = trace_line(*alone, {0.5, 0.1, 0.1}, {.time = 10});
  EXPECT_EQ(line.end, FlowStatus::blanked);
  EXPECT_NEAR(line.points.back().position.x, 1.5, 1e-9);
  EXPECT_EQ(alone->find({1.7, 0.1, 0.1}, 0).status, FlowStatus::blanked);
  // A block behind it stands in.
  EXPECT_EQ(refer(curvilinear_flow({first, second}).model())->at({1.7, 0.1, 0.1}, 0).vector.x, 2);
}

}  // namespace
}  // namespace smurf::test
