// W5: Runge-Kutta steps of streamlines a second, all positions kept, of a rotation and of ABC flow: as expressions, and
// ABC flow on a grid of 64³ over [0, 2π]³; from random seeds and from seeds on a line. Beside them VTK's tracer on the
// same grid, with steps of about the same length.
//
// A benchmark's name is W5-<field>-<seeds>/<number of seeds>/<who>. Lines end where they leave the domain, so that the
// number of steps is counted, not calculated. `ends_apart` is the greatest distance, in parts of the extent, between
// lines and the same lines at half the step.
#include <fmt/format.h>

#include <algorithm>

#include "abc_flow.hpp"
#include "benchmarks.hpp"
#include "smurf/flow.hpp"
#include "workloads/workloads.hpp"
#ifdef SMURF_BENCH_VTK
#include "peers/vtk_streamlines.hpp"
#endif

namespace smurf::bench {
namespace {

constexpr double step = 0.01, time = 10;

VectorField rotation() { return expression_flow({"-y", "x", "0.3"}, {glm::dvec3(-7), glm::dvec3(7)}); }

struct FieldToTrace {
  std::string name;
  std::function<VectorField()> field;
  bool on_grid;  // VTK has it, too
};

std::vector<glm::dvec3> seeds_of(std::size_t count, bool on_line) {
  std::vector<glm::dvec3> seeds;
  workloads::Dice dice(7);
  for (std::size_t i = 0; i < count; i++) {
    if (on_line) {
      seeds.emplace_back(1 + 4 * (double(i) + 0.5) / double(count), 3, 3);
    } else {
      const double x = dice.unit(), y = dice.unit(), z = dice.unit();
      seeds.emplace_back(glm::dvec3(x, y, z) * turn);
    }
  }
  return seeds;
}

// The greatest distance of ends that are reached by time, over the extent.
double ends_apart(const Streamlines& one, const Streamlines& other) {
  double apart = 0;
  for (std::size_t i = 0; i < one.size(); i++) {
    if (one.end[i] != FlowStatus::time || other.end[i] != FlowStatus::time) continue;
    const glm::dvec3 p(one.positions[one.offsets[i + 1] - 1]), q(other.positions[other.offsets[i + 1] - 1]);
    apart = std::max(apart, glm::length(p - q));
  }
  return apart / turn;
}

void add_device(const FieldToTrace& field, const std::string& name, const std::vector<glm::dvec3>& seeds,
                const DeviceInfo& info, int lanes) {
  add(name, [=] {
    DeviceOptions options;
    if (info.executor == "opencl") options.lanes = lanes;
    const Device device = open_device(fmt::format("{}:{}", info.executor, info.index), options);
    const auto tracer = std::make_shared<Tracer>(device, field.field());
    const auto lines = std::make_shared<Streamlines>();
    const TraceOptions fixed{.time = time, .integrator = Integrator::rk4, .step = step};
    TraceOptions finer = fixed;
    finer.step = step / 2;
    Ready result;
    result.run = [=] { *lines = tracer->trace({.positions = seeds}, fixed); };
    result.run();
    result.count = lines->steps;
    result.label = fmt::format("{}, {} steps", info.name, lines->steps);
    result.counters = {{"ends_apart", ends_apart(*lines, tracer->trace({.positions = seeds}, finer))},
                       {"device_bytes", double(tracer->device_bytes())}};
    return result;
  });
}

#ifdef SMURF_BENCH_VTK
void add_vtk(const std::string& name, const std::vector<glm::dvec3>& seeds) {
  add(name, [=] {
    const auto tracer = std::make_shared<VtkStreamTracer>(abc_grid());
    const auto lines = std::make_shared<VtkLines>();
    constexpr double speed = 2.4;  // the flow's mean, about
    Ready result;
    result.run = [=] { *lines = tracer->rk4(seeds, speed * step, speed * time); };
    result.run();
    result.count = lines->steps();
    result.label = fmt::format("vtkStreamTracer, {} steps", result.count);
    return result;
  });
}
#endif

}  // namespace

void add_streamlines() {
  const std::vector<FieldToTrace> fields = {
      {"rotation", rotation, false},
      {"abc", [] { return abc_expression(); }, false},
      {"abc-trilinear", [] { return grid_flow(abc_grid()); }, true},
      {"abc-tricubic", [] { return grid_flow(abc_grid(), VectorReconstruction::tricubic); }, false}};
  for (const FieldToTrace& field : fields) {
    for (const bool on_line : {false, true}) {
      for (const std::size_t count : {std::size_t(200), std::size_t(20'000)}) {
        const std::vector<glm::dvec3> seeds = seeds_of(count, on_line);
        const std::string task = fmt::format("W5-{}-{}/{}", field.name, on_line ? "line" : "random", count);
        for (const DeviceInfo& info : list_devices()) {
          if (info.executor == "reference") continue;
          const bool every_lane_count = info.executor == "opencl" && info.lanes > 1;
          for (const int lanes : every_lane_count ? std::vector<int>{1, 16} : std::vector<int>{info.lanes})
            add_device(field, fmt::format("{}/{}:{}/lanes:{}", task, info.executor, info.index, lanes), seeds, info,
                       lanes);
        }
#ifdef SMURF_BENCH_VTK
        if (field.on_grid) add_vtk(task + "/vtk", seeds);
#endif
      }
    }
  }
}

}  // namespace smurf::bench
