// smurf-bench: the workloads of `smurf bench` under Google Benchmark, on every device and lane count, beside the peers
// that were found at configuration. Its options are Google Benchmark's, for instance --benchmark_filter=W1
// --benchmark_out=FILE.
//
// A benchmark's name is workload/size/who. A repetition is as many whole calls in a row as take a tenth of a second,
// one at least: calls of a few milliseconds that stand alone tell of sleeping cores. The median of the repetitions
// counts.
// What is set up for one benchmark (device, surface, answers of the reference) is kept until the next one begins.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <string>

#include "benchmarks.hpp"
#include "patches/bezier.hpp"
#include "peers/gage.hpp"
#include "peers/isosurface_mesh.hpp"
#include "ratio_reporter.hpp"
#include "smurf/error.hpp"
#include "workloads/measure.hpp"
#ifdef SMURF_BENCH_EMBREE
#include "peers/embree.hpp"
#endif

namespace {

using namespace smurf;
using namespace smurf::bench;
using namespace smurf::workloads;

// Tasks by workload and size: the reference's answers are shared by all devices and peers.
Task& shared_task(const Workload& workload, int size) {
  static std::map<std::pair<std::string, int>, std::unique_ptr<Task>> tasks;
  std::erase_if(tasks, [&](const auto& entry) { return entry.first.first != workload.name; });
  auto& task = tasks[{workload.name, size}];
  if (!task) task = std::make_unique<Task>(workload, size);
  return *task;
}

Counters counters_of(const Measurement& m) {
  const Verdict& v = m.verdict;
  return {{"hits", double(m.hits)},
          {"flagged_fraction", m.flagged_fraction()},
          {"sampled", double(v.sampled)},
          {"missed", double(v.missed)},
          {"invented", double(v.invented)},
          {"t_error_voxels", v.t.worst},
          {"value_error", v.value.worst},
          {"normal_error", v.normal.worst},
          {"k_error_p99", v.curvature.p99},
          {"device_bytes", double(m.device_bytes)},
          {"reference_per_second", m.reference_rate}};
}

// A device's turn: sizes that take too long there are reduced, and the label says so.
Ready set_up_device(const Workload& workload, int size, const std::string& name, int lanes) {
  DeviceOptions options;
  options.lanes = lanes;
  struct Kept {
    explicit Kept(const Device& opened) : device(opened) {}
    Device device;
    std::optional<Interrogator> interrogator;
    Answers answers;
  };
  auto kept = std::make_shared<Kept>(open_device(name, options));
  const int fitting = fitting_size(kept->device, workload, size, Budget{});
  Task& task = shared_task(workload, fitting);
  kept->interrogator.emplace(kept->device, task.surface());

  Ready result;
  result.count = task.count();
  result.run = [kept, &task] { kept->answers = ask(*kept->interrogator, task); };
  result.run();
  Measurement m;
  m.count = task.count();
  m.device_bytes = kept->interrogator->device_bytes();
  if (kept->answers.hits) count_hits(*kept->answers.hits, m);
  m.verdict = kept->answers.hits ? task.judge(*kept->answers.hits) : task.judge(kept->answers.points);
  m.reference_rate = task.reference().rate();
  result.counters = counters_of(m);
  result.label =
      kept->device.info().name + (fitting == size ? "" : fmt::format(", at {} instead of {}", fitting, size));
  return result;
}

void add_devices(const Workload& workload, int size) {
  const std::string prefix = fmt::format("{}/{}/", workload.name, size);
  for (const DeviceInfo& info : list_devices()) {
    if (info.executor == "reference") continue;
    const std::string device = fmt::format("{}:{}", info.executor, info.index);
    // Lanes are for processors; on a device that prefers one, only that is measured.
    const bool every_lane_count = info.executor == "opencl" && info.lanes > 1;
    for (int lanes : every_lane_count ? std::vector<int>{1, 4, 8, 16} : std::vector<int>{info.lanes})
      add(fmt::format("{}{}/lanes:{}", prefix, device, lanes),
          [=] { return set_up_device(workload, size, device, info.executor == "opencl" ? lanes : 0); });
  }
}

#ifdef SMURF_BENCH_EMBREE
enum class Trace { single, packets, all };

struct EmbreeTurn {
  std::unique_ptr<EmbreeScene> scene;
  ClosestHits closest;
  AllHits all;
};

void trace(EmbreeTurn& turn, Trace how, const RayBatch& rays) {
  switch (how) {
    case Trace::single:
      return turn.scene->closest_single(rays, turn.closest);
    case Trace::packets:
      return turn.scene->closest_packets(rays, turn.closest);
    case Trace::all:
      return turn.scene->all(rays, turn.all);
  }
}

// How far Embree's answers are from `truth`, which has the hits of the rays that `rays` numbers: rays with another
// number of hits, or a first hit off by over a voxel.
Counters compare(const EmbreeTurn& turn, Trace how, const HitList& truth, const std::vector<std::size_t>& rays,
                 double voxel, const std::string& prefix = "") {
  std::size_t other_count = 0, off = 0;
  double worst = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const std::size_t ray = rays[i], first = truth.offsets()[i], expected = truth.offsets()[i + 1] - first;
    if (how == Trace::all) {
      other_count += turn.all.offsets[ray + 1] - turn.all.offsets[ray] != expected;
      continue;
    }
    const bool hit = std::isfinite(turn.closest.t[ray]);
    other_count += hit != (expected > 0);
    if (!hit || expected == 0) continue;
    const double error = std::abs(double(turn.closest.t[ray]) - double(truth.t()[first])) / voxel;
    off += error > 1;
    worst = std::max(worst, error);
  }
  return {{prefix + "sampled", double(rays.size())},
          {prefix + "other_count", double(other_count)},
          {prefix + "off_by_a_voxel", double(off)},
          {prefix + "t_error_voxels", worst}};
}

using Check = std::function<Counters(const EmbreeTurn&, Trace)>;

// A scene and what it is.
struct EmbreeModel {
  std::unique_ptr<EmbreeScene> scene;
  std::string label;
};
using MakeScene = std::function<EmbreeModel()>;

MakeScene scene_of(const std::function<TriangleMesh()>& mesh, bool robust) {
  return [=]() -> EmbreeModel {
    const TriangleMesh triangles = mesh();
    return {std::make_unique<EmbreeScene>(triangles, robust),
            fmt::format("Embree{}, {} triangles", robust ? " robust" : "", triangles.triangles.size())};
  };
}

void add_embree(const std::string& name, const MakeScene& make, Trace how, const std::function<RayBatch()>& rays,
                const Check& check) {
  add(name, [=] {
    auto turn = std::make_shared<EmbreeTurn>();
    EmbreeModel model = make();
    turn->scene = std::move(model.scene);
    auto batch = std::make_shared<RayBatch>(rays());
    Ready result;
    result.count = batch->size();
    result.run = [=] { trace(*turn, how, *batch); };
    result.run();
    result.label = model.label;
    if (check) result.counters = check(*turn, how);
    return result;
  });
}

// Closest hits by single rays and by packets, or all hits.
void add_embree_for(const Workload& workload, int size, const MakeScene& make, const Check& check) {
  const std::string prefix = fmt::format("{}/{}/embree-", workload.name, size);
  auto rays = [=] { return shared_task(workload, size).rays(); };
  if (workload.kind == Kind::all_hits) {
    add_embree(prefix + "all", make, Trace::all, rays, check);
  } else {
    add_embree(prefix + "single", make, Trace::single, rays, check);
    add_embree(prefix + "packets", make, Trace::packets, rays, check);
  }
}

Counters compare_with_reference(const Workload& workload, int size, const EmbreeTurn& turn, Trace how) {
  const ReferenceAnswers& reference = shared_task(workload, size).reference();
  return compare(turn, how, reference.hits(), reference.sample(), reference.voxel());
}

void add_embree_on_isosurface(const Workload& workload, int size) {
  auto mesh = [=] {
    const Volume volume = workload.volume();
    return isosurface_mesh(samples_as_float(volume), volume.size(), volume.placement(), workload.isovalue);
  };
  auto check = [=](const EmbreeTurn& turn, Trace how) { return compare_with_reference(workload, size, turn, how); };
  add_embree_for(workload, size, scene_of(mesh, false), check);
}

// The same triangles in Embree's robust mode, which may not miss at edges either. Its answers stand beside the
// reference's on the sample, and on all rays beside smurf's on a processor.
void add_embree_on_mesh(const Workload& workload, int size) {
  auto mesh = [=] { return triangles_of(workload.mesh()); };
  auto check = [=](const EmbreeTurn& turn, Trace how) {
    Counters counters = compare_with_reference(workload, size, turn, how);
    const Task& task = shared_task(workload, size);
    const Answers answers = ask(Interrogator(open_device("opencl"), task.surface()), task);
    std::vector<std::size_t> all(task.count());
    std::iota(all.begin(), all.end(), std::size_t(0));
    counters.merge(compare(turn, how, *answers.hits, all, workload.length_unit(), "all_rays_"));
    return counters;
  };
  add_embree_for(workload, size, scene_of(mesh, true), check);
}

// Grids of 64 × 64 quadrilaterals for each Bézier piece: flat within, so that the answer is another one.
void add_embree_on_patches(const Workload& workload, int size) {
  constexpr unsigned cells = 64;
  const MakeScene make = [=]() -> EmbreeModel {
    GridMesh mesh;
    mesh.width = cells + 1;
    for (const Patch& patch : workload.patches()) {
      for (const BezierPiece& piece : bezier_pieces(patch, 0)) {
        mesh.grids++;
        for (unsigned j = 0; j <= cells; j++) {
          for (unsigned i = 0; i <= cells; i++) {
            const glm::dvec2 at = piece.lower + (piece.upper - piece.lower) * glm::dvec2(i, j) / double(cells);
            mesh.vertices.emplace_back(evaluate(piece, at.x, at.y).position);
          }
        }
      }
    }
    return {std::make_unique<EmbreeScene>(mesh), fmt::format("Embree, {} grids of {}x{}", mesh.grids, cells, cells)};
  };
  auto check = [=](const EmbreeTurn& turn, Trace how) { return compare_with_reference(workload, size, turn, how); };
  add_embree_for(workload, size, make, check);
}

// The calibration E of machines against each other, on the bunny or what stands for it.
void add_calibration() {
  const BunnyOrSphere source = bunny_or_sphere();
  auto mesh = [=] { return triangles_of(source.mesh()); };
  auto rays = [=] {
    const Mesh seen = source.mesh();
    return fitted_camera({glm::dvec3(seen.lower()), glm::dvec3(seen.upper())}, 1024, 1024).rays();
  };
  const std::string prefix = source.is_bunny ? "E-bunny00/1024/embree-" : "E-sphere/1024/embree-";
  add_embree(prefix + "single", scene_of(mesh, false), Trace::single, rays, {});
  add_embree(prefix + "packets", scene_of(mesh, false), Trace::packets, rays, {});
  add_embree(prefix + "all", scene_of(mesh, false), Trace::all, rays, {});
}
#endif

// W6: normals, principal curvatures and directions at all vertices of the bunny or what stands for it, and of a
// generated mesh eight times as large, host tables included. Differences are told relative to the greater principal
// curvature, from the reference's jets: another estimate, not the truth.
PointProperties ask_vertices(const Device& device, const Mesh& mesh) {
  return vertex_properties(device, mesh, Property::normal | Property::principal | Property::directions);
}

Counters compare_vertices(const PointProperties& found, const PointProperties& expected) {
  std::vector<double> errors;
  std::size_t other_status = 0;
  for (std::size_t i = 0; i < expected.k1.size(); i++) {
    other_status += ((found.status[i] ^ expected.status[i]) & ~std::uint32_t(PointStatus::umbilic)) != 0;
    const double size = std::max(std::abs(expected.k1[i]), std::abs(expected.k2[i]));
    if (!(size > 0) || std::isnan(found.k1[i])) continue;
    errors.push_back(std::max(std::abs(found.k1[i] - expected.k1[i]), std::abs(found.k2[i] - expected.k2[i])) / size);
  }
  std::ranges::sort(errors);
  if (errors.empty()) return {};
  return {{"other_status", double(other_status)}, {"k_difference_median", errors[errors.size() / 2]}};
}

void add_vertices() {
  struct Size {
    std::string name;
    std::function<Mesh()> mesh;
  };
  const BunnyOrSphere source = bunny_or_sphere();
  const std::vector<Size> sizes = {{source.is_bunny ? "W6-bunny00" : "W6-sphere", source.mesh},
                                   {"W6-sphere-8", [] { return bumpy_sphere(8 * 75'408); }}};
  for (const auto& [workload, make] : sizes) {
    for (const DeviceInfo& info : list_devices()) {
      const bool is_reference = info.executor == "reference";
      const bool every_lane_count = info.executor == "opencl" && info.lanes > 1;
      for (int lanes : every_lane_count ? std::vector<int>{1, 4, 8, 16} : std::vector<int>{info.lanes}) {
        const std::string device =
            is_reference ? info.executor : fmt::format("{}:{}/lanes:{}", info.executor, info.index, lanes);
        add(fmt::format("{}/{}", workload, device), [=] {
          DeviceOptions options;
          if (info.executor == "opencl") options.lanes = lanes;
          const Device opened =
              open_device(is_reference ? info.executor : fmt::format("{}:{}", info.executor, info.index), options);
          const Mesh mesh = make();
          Ready result;
          result.count = mesh.vertex_count();
          result.label = fmt::format("{}, {} vertices", opened.info().name, result.count);
          const PointProperties found = ask_vertices(opened, mesh);
          if (!is_reference) result.counters = compare_vertices(found, ask_vertices(open_device("reference"), mesh));
          result.run = [=] { ask_vertices(opened, mesh); };
          return result;
        });
      }
    }
  }
}

// Gage wants points in index space, and leaves out what is near the boundary, where it continues the data otherwise.
void add_gage(const Workload& workload, int size) {
  add(fmt::format("{}/{}/gage", workload.name, size), [=] {
    const Volume volume = workload.volume();
    auto probe = std::make_shared<GageProbe>(samples_as_float(volume), volume.size());
    auto points = std::make_shared<std::vector<glm::vec3>>(shared_task(workload, size).points());
    const glm::dmat3 to_index = glm::inverse(volume.placement().axes);
    for (glm::vec3& p : *points) p = glm::vec3(to_index * (glm::dvec3(p) - volume.placement().origin));
    auto answers = std::make_shared<GageAnswers>();
    Ready result;
    result.count = points->size();
    result.run = [=] { probe->all_properties(*points, *answers); };
    result.run();
    result.label = "teem gage, cubic B-spline, prefiltered";
    const ReferenceAnswers& reference = shared_task(workload, size).reference();
    double worst = 0;
    for (std::size_t i = 0; i < reference.sample().size(); i++) {
      const std::size_t point = reference.sample()[i];
      const glm::vec3 p = (*points)[point], last(volume.size() - 1);
      if (glm::any(glm::lessThan(p, glm::vec3(2))) || glm::any(glm::greaterThan(p, last - 2.0f))) continue;
      worst = std::max(worst, std::abs(double(answers->value[point]) - double(reference.probed().value[i])));
    }
    result.counters = {{"value_error", worst / (volume.maximum() - volume.minimum())}};
    return result;
  });
}

// The scalar reference, on a few of the queries drawn at random.
void add_reference(const Workload& workload, int size) {
  add(fmt::format("{}/{}/reference", workload.name, size), [=] {
    const Task& task = shared_task(workload, size);
    auto interrogator = std::make_shared<Interrogator>(open_device("reference"), task.surface());
    Ready result;
    result.count = std::min<std::size_t>(2048, task.count());
    result.label = fmt::format("double precision, on {} drawn at random", result.count);
    Dice dice(3);
    if (workload.casts()) {
      auto rays = std::make_shared<RayBatch>(result.count);
      for (std::size_t i = 0; i < result.count; i++) rays->set(i, task.rays()[dice.below(task.count())]);
      result.run = [=] { interrogator->cast(*rays, workload.cast_options()); };
    } else {
      auto points = std::make_shared<std::vector<glm::vec3>>();
      for (std::size_t i = 0; i < result.count; i++) points->push_back(task.points()[dice.below(task.count())]);
      result.run = [=] { interrogator->probe(*points, workload.properties); };
    }
    result.run();
    return result;
  });
}

}  // namespace

int main(int argc, char** argv) {
  try {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
#ifdef SMURF_BENCH_EMBREE
    add_calibration();
#endif
    add_vertices();
    add_streamlines();
    add_stream_surfaces();
    add_walks();
    add_coherence();
    const Catalogue list = catalogue();
    for (const Workload& workload : list.workloads) {
      for (int size : workload.sizes) {
        add_devices(workload, size);
        add_reference(workload, size);
#ifdef SMURF_BENCH_EMBREE
        if (workload.samples() && workload.casts() && workload.reconstruction == Reconstruction::trilinear)
          add_embree_on_isosurface(workload, size);
        if (workload.mesh) add_embree_on_mesh(workload, size);
        if (workload.patches) add_embree_on_patches(workload, size);
#endif
        if (!workload.casts()) add_gage(workload, size);
      }
    }
    for (const Missing& entry : list.missing) fmt::print(stderr, "not measured: {}: {}\n", entry.name, entry.reason);
    RatioReporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter);
    benchmark::Shutdown();
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "smurf-bench: {}\n", error.what());
    return 1;
  }
}
