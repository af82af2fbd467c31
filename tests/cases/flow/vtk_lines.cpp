// Lines through measured and simulated data beside those of VTK's vtkStreamTracer, on the same vectors and from the
// same seeds: another opinion on fields of which nobody knows the lines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "flows/curvilinear/definition.hpp"
#include "flows/grid/definition.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/flow.hpp"
#ifdef SMURF_TEST_VTK
#include "peers/vtk_streamlines.hpp"
#endif

namespace smurf::test {

KERNELS(trace_lines);

#ifndef SMURF_TEST_VTK
TEST(FlowBesideVtk, NeedsVtk) {
  report_missing("VTK, beside which lines are tested (Debian: libvtk9-dev)");
  GTEST_SKIP();
}
#else
namespace {

using bench::VtkLines;
using bench::VtkStreamTracer;
using glm::dvec3;

// Vectors at nodes, as both kinds of grid have them.
struct Nodes {
  std::vector<dvec3> points;
  std::vector<double> speeds;
};

Nodes nodes_of(const VectorField& field) {
  Nodes nodes;
  if (const auto* flow = dynamic_cast<const GridFlow*>(&field.model())) {
    const VectorGrid& grid = flow->grid;
    for (int k = 0; k < grid.size.z; k++)
      for (int j = 0; j < grid.size.y; j++)
        for (int i = 0; i < grid.size.x; i++)
          nodes.points.push_back(grid.placement.origin + grid.placement.axes * dvec3(i, j, k));
    for (const glm::vec3& v : grid.vectors) nodes.speeds.push_back(glm::length(dvec3(v)));
  } else {
    const CurvilinearBlock& block = dynamic_cast<const CurvilinearFlow&>(field.model()).blocks.front();
    nodes.points.assign(block.points.begin(), block.points.end());
    for (const glm::vec3& v : block.vectors) nodes.speeds.push_back(glm::length(dvec3(v)));
  }
  return nodes;
}

// Between two nodes of which one is fast, evenly among all that are: lines that hardly move tell nothing.
std::vector<dvec3> seeds_of(const VectorField& field) {
  constexpr std::size_t count = 40;
  const Nodes nodes = nodes_of(field);
  const double fast = 0.3 * *std::ranges::max_element(nodes.speeds);
  std::vector<dvec3> candidates;
  for (std::size_t i = 0; i + 1 < nodes.points.size(); i++)
    if (nodes.speeds[i] > fast) candidates.push_back(glm::mix(nodes.points[i], nodes.points[i + 1], 0.3));
  std::vector<dvec3> seeds;
  for (std::size_t i = 0; i < count; i++) seeds.push_back(candidates[i * candidates.size() / count]);
  return seeds;
}

std::unique_ptr<VtkStreamTracer> vtk_tracer(const VectorField& field) {
  if (const auto* grid = dynamic_cast<const GridFlow*>(&field.model()))
    return std::make_unique<VtkStreamTracer>(grid->grid);
  return std::make_unique<VtkStreamTracer>(dynamic_cast<const CurvilinearFlow&>(field.model()).blocks.front());
}

struct Nearness {
  double distance;
  bool at_end;  // nothing of the line is nearer than its last position
};

Nearness nearness(const Streamlines& lines, std::size_t line, const dvec3& p) {
  Nearness least{HUGE_VAL, false};
  for (std::size_t k = lines.offsets[line]; k + 1 < lines.offsets[line + 1]; k++) {
    const dvec3 a(lines.positions[k]), d = dvec3(lines.positions[k + 1]) - a;
    const double part = std::clamp(glm::dot(p - a, d) / std::max(glm::dot(d, d), 1e-300), 0.0, 1.0);
    const double distance = glm::length(p - a - part * d);
    if (distance < least.distance) least = {distance, k + 2 == lines.offsets[line + 1] && part == 1};
  }
  return least;
}

// Of each line of VTK's the greatest distance from ours, in parts of the extent, until ours ends. Places are compared,
// not times: VTK adds up the times of steps by the speed at their beginning, which is of first order.
std::vector<double> apart(const VtkLines& theirs, const Streamlines& ours, double extent) {
  std::vector<double> distances;
  for (std::size_t i = 0; i < theirs.seeds.size(); i++) {
    double most = 0;
    for (std::size_t k = theirs.offsets[i]; k < theirs.offsets[i + 1]; k++) {
      const Nearness near = nearness(ours, theirs.seeds[i], theirs.positions[k]);
      if (near.at_end) break;
      most = std::max(most, near.distance);
    }
    distances.push_back(most / extent);
  }
  std::ranges::sort(distances);
  return distances;
}

class FlowBesideVtk : public testing::TestWithParam<const char*> {};  // a file in host/data

TEST_P(FlowBesideVtk, TheSameLines) {
  const VectorField field = load_vector_field(std::filesystem::path(SMURF_SOURCE_DIR) / "host/data" / GetParam());
  const Bounds bounds = field.bounds();
  const dvec3 size = bounds.upper - bounds.lower;
  const double extent = std::max({size.x, size.y, size.z});
  const std::vector<dvec3> seeds = seeds_of(field);
  const VtkLines theirs = vtk_tracer(field)->adaptive(seeds, 1e-3 * extent, 0.3 * extent, 1e-7 * extent);
  ASSERT_GE(theirs.seeds.size(), 30u);
  // So close that lines are straight between positions, to 1e-5 of the extent where they bend within a cell; and as
  // long as the fastest need for the extent: lines that come to where nothing moves take forever.
  const double interval = 5e-4 * extent / field.model().greatest_speed();
  for (const TestDevice& device : one_of_each()) {
    const Streamlines ours =
        Tracer(device.device, field)
            .trace({.positions = seeds}, {.time = 2000 * interval, .tolerance = 1e-7 * extent, .interval = interval});
    const std::vector<double> distances = apart(theirs, ours, extent);
    // Some 100 steps of both err by 1e-7 of the extent each, and lines part; chords are off by 1e-5 where they bend
    // most.
    EXPECT_LT(distances[distances.size() / 2], 3e-6) << device.label;
    EXPECT_LT(distances.back(), 3e-5) << device.label;
    EXPECT_GT(ours.steps, seeds.size() * 10) << device.label;
  }
}

INSTANTIATE_TEST_SUITE_P(Data, FlowBesideVtk, testing::Values("carotid.vtk", "combustor.json", "office.vtk"));

}  // namespace
#endif

}  // namespace smurf::test
