// W5: stream surfaces of ABC flow, from a segment of 4 along x.
//
//   W5-surface-<field>/<time>/<who>          set-up of the explicit surface, in triangles a second (a cell of n corners
//                                            counts as n - 2); beside VTK's vtkStreamSurface from 200 seeds
//   W5-surface-first, W5-surface-all           a camera's rays, of which all count: first hits with normals, all hits
//   W5-surface-back-first, -all                the same by the back-stream method
//   W5-curvature-interpolated, -integrated     normals and all curvatures at random places of the surface
//
// Sizes are 10 times the time of the surface for set-up, the width of the image, and the number of places. Surfaces for
// rays are of T = 3, and of T = 1.5 (W5-surface-short-...), in a box that no streamline leaves. In the same run:
//   deviation        the greatest distance of the mesh from the true surface at 10,000 random (u, τ), integrated, in
//                    parts of the extent, 2π; of VTK's triangles that of their centres from smurf's surface
//   sampled          hits that are not proved, in parts of all hits
//   hit_rays         rays that hit, in parts of all rays
//   other_count      of 512 rays, half of which hit: those on which the reference finds another number of hits
//   mean_error       the greatest error of mean curvature at 512 places, over the rms of it, against the reference
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "abc_flow.hpp"
#include "benchmarks.hpp"
#include "smurf/camera.hpp"
#include "smurf/compare.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"
#include "workloads/workloads.hpp"
#ifdef SMURF_BENCH_VTK
#include "peers/vtk_streamlines.hpp"
#endif

namespace smurf::bench {
namespace {

using workloads::Dice;

constexpr glm::dvec3 first_seed(1, 3, 3), last_seed(5, 3, 3);
constexpr std::uint32_t curved =
    Property::normal | Property::gauss | Property::mean | std::uint32_t(Property::principal);
constexpr std::size_t checked = 512;

VectorField in_a_large_box() { return abc_expression({glm::dvec3(-8), glm::dvec3(8)}); }

Surface surface_of(const VectorField& field, StreamOptions options) {
  options.tolerance = 1e-5 * turn;
  return stream_surface(field, seed_points({first_seed, last_seed}), options);
}

struct Executor {
  std::string name;  // as open_device takes it
  std::string label;
  int lanes;
};

// One for each device, with the lanes that it prefers.
std::vector<Executor> executors() {
  std::vector<Executor> found;
  for (const DeviceInfo& info : list_devices()) {
    if (info.executor == "reference") continue;
    found.push_back({fmt::format("{}:{}", info.executor, info.index), info.name, info.lanes});
  }
  return found;
}

Device open_executor(const Executor& executor) {
  DeviceOptions options;
  if (executor.name.starts_with("opencl")) options.lanes = executor.lanes;
  return open_device(executor.name, options);
}

std::size_t triangles_of(const StreamPolygons& polygons) {
  return polygons.corners.size() - 2 * (polygons.offsets.size() - 1);
}

std::vector<SurfaceCoordinates> random_places(const Surface& surface, std::size_t count) {
  const glm::dvec2 u = seed_range(surface), time = options_of(surface).time;
  Dice dice(11);
  std::vector<SurfaceCoordinates> places(count);
  for (SurfaceCoordinates& place : places) {
    place.u = float(u.x + dice.unit() * (u.y - u.x));
    place.v = float(time.x + dice.unit() * (time.y - time.x));
  }
  return places;
}

Surface by(const Surface& surface, StreamDerivatives derivatives) {
  StreamOptions options = options_of(surface);
  options.derivatives = derivatives;
  return with_options(surface, options);
}

// Over the extent of the field that others have, 2π.
double deviation_of(const Device& device, const Surface& surface) {
  const std::vector<SurfaceCoordinates> places = random_places(surface, 10'000);
  const auto located = [&](StreamDerivatives derivatives) {
    return Interrogator(device, by(surface, derivatives))
        .properties_at(places, std::uint32_t(Property::location))
        .location;
  };
  const Column<glm::vec3> mesh = located(StreamDerivatives::interpolated),
                          right = located(StreamDerivatives::integrated);
  double greatest = 0;
  for (std::size_t i = 0; i < places.size(); i++) {
    const double apart = glm::length(glm::dvec3(mesh[i]) - glm::dvec3(right[i]));
    if (std::isfinite(apart)) greatest = std::max(greatest, apart);
  }
  return greatest / turn;
}

void add_set_up(const std::string& task, const std::function<VectorField()>& make_field, double time,
                const Executor& executor) {
  add(fmt::format("{}/{}/lanes:{}", task, executor.name, executor.lanes), [=] {
    const Device device = open_executor(executor);
    const VectorField field = make_field();
    const auto make = [=] { return surface_of(field, {.time = {0, time}}); };
    const Surface surface = make();
    const Interrogator query(device, surface);
    const StreamPolygons polygons = stream_polygons(surface);
    Ready result;
    result.run = [=] { Interrogator(device, make()); };
    result.count = triangles_of(polygons);
    result.label = fmt::format("{}, {} cells", executor.label, polygons.offsets.size() - 1);
    result.counters = {{"deviation", deviation_of(device, surface)}, {"device_bytes", double(query.device_bytes())}};
    return result;
  });
}

#ifdef SMURF_BENCH_VTK
// The distance of the centres of 2,048 triangles from smurf's surface of the same grid, over the extent: the greatest.
double distance_from(const Surface& surface, const VtkTriangles& mesh) {
  Dice dice(5);
  std::vector<glm::vec3> centres;
  for (int i = 0; i < 2048; i++) {
    const glm::uvec3& t = mesh.triangles[dice.below(mesh.triangles.size())];
    centres.emplace_back((mesh.points[t.x] + mesh.points[t.y] + mesh.points[t.z]) / 3.0);
  }
  const Interrogator query(open_device(executors().front().name), surface);
  const Column<glm::vec3> nearest = query.probe(centres, std::uint32_t(Property::location)).location;
  double greatest = 0;
  for (std::size_t i = 0; i < centres.size(); i++)
    greatest = std::max(greatest, glm::length(glm::dvec3(nearest[i]) - glm::dvec3(centres[i])));
  return greatest / turn;
}

// VTK goes by length: its lines are about as long as those of the time.
void add_vtk(const std::string& task, double time, bool adaptive) {
  add(fmt::format("{}/{}", task, adaptive ? "vtk-adaptive" : "vtk-ruled"), [=] {
    constexpr double speed = 2.4, step = 0.01;
    const auto tracer = std::make_shared<VtkStreamTracer>(abc_grid());
    std::vector<glm::dvec3> seeds;
    for (int i = 0; i < 200; i++) seeds.push_back(first_seed + (last_seed - first_seed) * (i / 199.0));
    const auto mesh = std::make_shared<VtkTriangles>();
    Ready result;
    result.run = [=] { *mesh = tracer->surface(seeds, speed * step, speed * time, adaptive); };
    result.run();
    result.count = mesh->triangles.size();
    result.label = fmt::format("vtkStreamSurface, {} triangles", result.count);
    // Long enough that every place of VTK's lines is on it.
    const Surface surface = surface_of(grid_flow(abc_grid()), {.time = {0, 2 * time}});
    if (!executors().empty()) result.counters = {{"deviation", distance_from(surface, *mesh)}};
    return result;
  });
}
#endif

// From above, where the surface is widest, and near: most of the picture would be empty otherwise.
RayBatch rays_of(const Surface& surface, int width) {
  const Bounds bounds = surface.bounds();
  Camera camera = fitted_camera(bounds, width, width);
  camera.eye = camera.look_at + glm::length(bounds.upper - bounds.lower) * glm::normalize(glm::dvec3(0.3, -0.4, 1));
  return camera.rays();
}

// Of all rays, the part that hits.
double part_that_hits(const HitList& hits) {
  std::size_t rays = 0;
  for (std::size_t i = 0; i < hits.ray_count(); i++) rays += hits.offsets()[i + 1] > hits.offsets()[i];
  return double(rays) / double(hits.ray_count());
}

double other_counts(const HitList& hits, const RayBatch& rays, const Surface& surface) {
  Dice dice(3);
  std::vector<std::size_t> sample;
  std::vector<Ray> few;
  while (sample.size() < checked) {
    const std::size_t ray = sample.size() < checked / 2 || hits.size() == 0 ? dice.below(rays.size())
                                                                            : hits.rays()[dice.below(hits.size())];
    sample.push_back(ray);
    few.push_back(rays[ray]);
  }
  const HitList right = Interrogator(open_device("reference"), surface).cast(RayBatch(few), {.hits = Hits::all});
  std::size_t other = 0;
  for (std::size_t i = 0; i < checked; i++) {
    const auto count = [](const HitList& list, std::size_t ray) {
      return list.offsets()[ray + 1] - list.offsets()[ray];
    };
    bool decided = true;
    for (std::size_t k = hits.offsets()[sample[i]]; k < hits.offsets()[sample[i] + 1]; k++)
      decided &= hits.status()[k] == HitStatus::isolated;
    other += decided && count(hits, sample[i]) != count(right, i);
  }
  return double(other);
}

struct Look {
  double time;
  StreamMethod method;
  Hits hits;
  int width;
};

void add_rays(const std::string& task, const Look& look, const Executor& executor) {
  add(fmt::format("{}/{}/lanes:{}", task, executor.name, executor.lanes), [=] {
    const Device device = open_executor(executor);
    // The camera is that of the mesh for both methods.
    const Surface mesh = surface_of(in_a_large_box(), {.time = {0, look.time}});
    const Surface surface = surface_of(in_a_large_box(), {.time = {0, look.time}, .method = look.method});
    const auto rays = std::make_shared<RayBatch>(rays_of(mesh, look.width));
    const auto query = std::make_shared<Interrogator>(device, surface);
    CastOptions options{.hits = look.hits};
    if (look.hits == Hits::first) options.properties = std::uint32_t(Property::normal);
    Ready result;
    result.run = [=] { query->cast(*rays, options); };
    result.count = rays->size();
    const HitList hits = query->cast(*rays, {.hits = Hits::all});
    std::size_t sampled = 0;
    for (const HitStatus status : hits.status()) sampled += status == HitStatus::sampled;
    result.label = fmt::format("{}, {} hits, {} sampled", executor.label, hits.size(), sampled);
    result.counters = {{"hit_rays", part_that_hits(hits)},
                       {"sampled", hits.size() > 0 ? double(sampled) / double(hits.size()) : 0},
                       {"other_count", other_counts(hits, *rays, surface)}};
    return result;
  });
}

double mean_error(const Interrogator& query, const Surface& surface) {
  const std::vector<SurfaceCoordinates> places = random_places(surface, checked);
  const auto wanted = std::uint32_t(Property::mean);
  const Column<float> found = query.properties_at(places, wanted).mean;
  const Column<float> right = Interrogator(open_device("reference"), surface).properties_at(places, wanted).mean;
  double greatest = 0, squares = 0;
  for (std::size_t i = 0; i < places.size(); i++) {
    if (!std::isfinite(right[i])) continue;
    greatest = std::max(greatest, std::abs(double(found[i]) - double(right[i])));
    squares += double(right[i]) * double(right[i]);
  }
  return greatest / std::sqrt(squares / double(places.size()));
}

void add_curvature(StreamDerivatives derivatives, std::size_t count, const Executor& executor) {
  add(fmt::format("W5-curvature-{}/{}/{}/lanes:{}", name_of(derivatives), count, executor.name, executor.lanes), [=] {
    const Device device = open_executor(executor);
    const Surface surface = surface_of(in_a_large_box(), {.time = {0, 3}, .derivatives = derivatives});
    const auto query = std::make_shared<Interrogator>(device, surface);
    const auto places = std::make_shared<std::vector<SurfaceCoordinates>>(random_places(surface, count));
    Ready result;
    result.run = [=] { query->properties_at(*places, curved); };
    result.count = count;
    result.label = executor.label;
    result.counters = {{"mean_error", mean_error(*query, surface)}};
    return result;
  });
}

}  // namespace

void add_stream_surfaces() {
  struct FieldToTrace {
    std::string name;
    std::function<VectorField()> field;
    bool on_grid;  // VTK has it, too
  };
  const std::vector<FieldToTrace> fields = {
      {"abc", [] { return abc_expression(); }, false},
      {"abc-trilinear", [] { return grid_flow(abc_grid()); }, true},
      {"abc-tricubic", [] { return grid_flow(abc_grid(), VectorReconstruction::tricubic); }, false}};
  const std::vector<Executor> all = executors();
  for (const FieldToTrace& field : fields) {
    for (const double time : {1.5, 3.0}) {
      const std::string task = fmt::format("W5-surface-{}/{}", field.name, int(10 * time));
      for (const Executor& executor : all) add_set_up(task, field.field, time, executor);
#ifdef SMURF_BENCH_VTK
      if (field.on_grid) {
        for (const bool adaptive : {false, true}) add_vtk(task, time, adaptive);
      }
#endif
    }
  }
  for (const double time : {1.5, 3.0}) {
    for (const StreamMethod method : {StreamMethod::mesh, StreamMethod::back_stream}) {
      const bool back = method == StreamMethod::back_stream;
      for (const Hits hits : {Hits::first, Hits::all}) {
        for (const int width : back ? std::vector<int>{256, 512} : std::vector<int>{512, 1024}) {
          const std::string task = fmt::format("W5-surface{}{}-{}/{}", time < 3 ? "-short" : "", back ? "-back" : "",
                                               hits == Hits::first ? "first" : "all", width);
          for (const Executor& executor : all) add_rays(task, {time, method, hits, width}, executor);
        }
      }
    }
  }
  for (const Executor& executor : all) {
    for (const std::size_t count : {std::size_t(100'000), std::size_t(1'000'000)})
      add_curvature(StreamDerivatives::interpolated, count, executor);
    for (const std::size_t count : {std::size_t(10'000), std::size_t(100'000)})
      add_curvature(StreamDerivatives::integrated, count, executor);
  }
}

}  // namespace smurf::bench
