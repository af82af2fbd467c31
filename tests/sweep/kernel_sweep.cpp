// Runs every kernel of kernels/kernels.def on a small case, for grids of every reconstruction and sample type, and
// compares with the reference: a program of its own, so that it can be started under oclgrind or on another OpenCL
// implementation.
//
//   kernel-sweep DEVICE LANES [WHAT ...]     grids by sample type, as in "uint8"; "mesh", "black-box", "parametric",
//                                            "nurbs", "flow", "stream"; all when none is given
//
// Exit codes: 0 all agree, 1 a difference or an error, 3 there is no such device.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "harness/hit_list_oracle.hpp"
#include "harness/judge.hpp"
#include "harness/tolerances.hpp"
#include "smurf/black_box.hpp"
#include "smurf/error.hpp"
#include "smurf/flow.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"
#include "truth/analytic.hpp"
#include "truth/meshes.hpp"
#include "truth/parametric_rays.hpp"
#include "truth/rays.hpp"

namespace smurf::test {
namespace {

constexpr std::string_view kind = "kernel sweep";

constexpr SampleType stored_types[] = {SampleType::float32, SampleType::uint8, SampleType::int8, SampleType::uint16,
                                       SampleType::int16};

// Blocks of 4³ cells and the data's border both come into play, and some rays miss.
Volume small_volume(SampleType type) {
  const glm::ivec3 size(8, 7, 6);
  const bool is_signed = type == SampleType::int8 || type == SampleType::int16;
  return sample(*torus_field({3.4, 2.9, 2.6}, 2.1, 1.1),
                {.size = size, .type = type, .scale = 25, .offset = is_signed ? -20.0 : 100.0});
}

double isovalue_of(const Volume& volume) { return 0.4 * volume.minimum() + 0.6 * volume.maximum(); }

// The largest relative difference of two columns, and whether they hold a NaN in different places.
double difference(std::span<const float> a, std::span<const float> b) {
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); i++) {
    if (std::isnan(a[i]) && std::isnan(b[i])) continue;
    const double error = std::abs(double(a[i]) - b[i]) / std::max(1.0, std::abs(double(b[i])));
    largest = std::isnan(error) ? HUGE_VAL : std::max(largest, error);
  }
  return largest;
}

class Sweep {
 public:
  Sweep(const std::string& name, int lanes)
      : device_(open_device(name, {.lanes = lanes, .validation = name.starts_with("vulkan")})),
        reference_(open_device("reference")) {}

  void run(Reconstruction reconstruction, SampleType type) {
    what_ = fmt::format("{} {}", name_of(reconstruction), name_of(type));
    const Volume volume = small_volume(type);
    const Surface surface = isosurface(volume, isovalue_of(volume), {reconstruction});
    const Interrogator query(device_, surface), truth(reference_, surface);

    RayBatch rays = random_chords(frame_of(volume), 160, 5).rays;
    rays.image_width = 16;  // so that rays are reordered
    const HitList hits = query.cast(rays, {.hits = Hits::all, .tile = 128}),
                  expected = truth.cast(rays, {.hits = Hits::all});
    expect(hits.size() > 50, "enough hits");
    if (!expect_hits(hits, expected, rays)) return;

    const HitList first = query.cast(rays, {.hits = Hits::first});
    expect(first.size() <= hits.size() && first.size() > 0, "first hits");

    // All properties at the same points.
    const auto points = expected.locations();
    const std::vector<glm::vec3> directions(points.size(), glm::vec3(0.3f, 0.5f, 0.8f));
    const std::uint32_t all = 127;
    const PointProperties a = query.probe(points, all, {.directions = directions});
    const PointProperties b = truth.probe(points, all, {.directions = directions});
    expect_close("value", difference(a.value, b.value), tolerance(Quantity::value, kind));
    expect_close("normal", difference(flat(a.normal), flat(b.normal)), tolerance(Quantity::normal, kind));
    expect_close("gauss", difference(a.gauss, b.gauss), tolerance(Quantity::curvature, kind));
    expect_close("mean", difference(a.mean, b.mean), tolerance(Quantity::curvature, kind));
    expect_close("k1", difference(a.k1, b.k1), tolerance(Quantity::curvature, kind));
    expect_close("k2", difference(a.k2, b.k2), tolerance(Quantity::curvature, kind));
    expect_close("normal curvature", difference(a.normal_curvature, b.normal_curvature),
                 tolerance(Quantity::curvature, kind));
    std::printf("%-22s %zu hits\n", what_.c_str(), hits.size());
  }

  // A small torus: rays, the vertices' normals and tensors, and points off it.
  void run_mesh() {
    what_ = "mesh";
    const Mesh mesh = torus_mesh(3, 1, 16, 10);
    const Surface surface = mesh_surface(mesh, MeshNormals::interpolated);
    const Interrogator query(device_, surface), truth(reference_, surface);
    GridFrame frame;
    frame.placement.origin = glm::dvec3(mesh.lower());
    for (int axis = 0; axis < 3; axis++) frame.placement.axes[axis][axis] = mesh.upper()[axis] - mesh.lower()[axis];
    const RayBatch rays = random_chords(frame, 100, 5).rays;
    const HitList hits = query.cast(rays, {.hits = Hits::all}), expected = truth.cast(rays, {.hits = Hits::all});
    expect_hits(hits, expected, rays);
    const auto points = expected.locations();
    const PointProperties a = query.probe(points, Property::normal | Property::mean),
                          b = truth.probe(points, Property::normal | Property::mean);
    expect_close("normal", difference(flat(a.normal), flat(b.normal)), tolerance(Quantity::normal, kind));
    // The torus itself.
    std::vector<float> mean;
    for (const glm::vec3& p : points) {
      const double out = std::hypot(p.x, p.y) - 3, cosine = out / std::hypot(out, double(p.z));
      mean.push_back(float(0.5 + 0.5 * cosine / (3 + cosine)));
    }
    expect_close("mean", difference(a.mean, mean), tolerance(Quantity::curvature, "kernel sweep, coarse mesh"));
    std::printf("%-22s %zu hits\n", what_.c_str(), hits.size());
  }

  // A surface in [-1, 1]³.
  void run_black_box(const Surface& surface) {
    what_ = "black box";
    const Interrogator query(device_, surface), truth(reference_, surface);
    GridFrame frame;
    frame.placement.origin = glm::dvec3(-1);
    for (int axis = 0; axis < 3; axis++) frame.placement.axes[axis][axis] = 2;
    const RayBatch rays = random_chords(frame, 60, 5).rays;
    const HitList hits = query.cast(rays, {.hits = Hits::all}), expected = truth.cast(rays, {.hits = Hits::all});
    expect(hits.size() > 20, "enough hits");
    if (!expect_hits(hits, expected, rays, HitStatus::bracketed)) return;
    const std::uint32_t wanted = Property::normal | Property::mean;
    const PointProperties a = query.probe(expected.locations(), wanted), b = truth.probe(expected.locations(), wanted);
    expect_close("normal", difference(flat(a.normal), flat(b.normal)), tolerance(Quantity::normal, kind));
    expect_close("mean", difference(a.mean, b.mean), tolerance(Quantity::curvature, kind));
    std::printf("%-22s %zu hits\n", what_.c_str(), hits.size());
  }

  // A surface s(u, v): random rays and rays at seams and poles, which are finished apart; and points off it.
  void run_parametric(const char* what, const Surface& surface, const RaySources& sources) {
    what_ = what;
    const Interrogator query(device_, surface), truth(reference_, surface);
    const std::vector<RayFamily> families = parametric_families(sources, 100, 20, 5);
    const RayBatch& rays = families[0].rays;
    const HitList hits = query.cast(rays, {.hits = Hits::all, .tile = 64}),
                  expected = truth.cast(rays, {.hits = Hits::all});
    expect(hits.size() > 30, "enough hits");
    if (!expect_hits(hits, expected, rays)) return;
    const HitList first = query.cast(rays, {.hits = Hits::first});
    expect(first.size() <= hits.size() && first.size() > 0, "first hits");
    std::size_t apart = 0;
    for (const RayFamily& family : families)
      if (family.name == "at seams and borders") apart = query.cast(family.rays, {.hits = Hits::all}).size();
    expect(apart > 0, "hits at seams");
    const auto points = expected.locations();
    const std::uint32_t wanted = Property::normal | Property::mean;
    const PointProperties a = query.probe(points, wanted), b = truth.probe(points, wanted);
    expect_close("normal", difference(flat(a.normal), flat(b.normal)), tolerance(Quantity::normal, kind));
    expect_close("mean", difference(a.mean, b.mean), tolerance(Quantity::curvature, kind));
    std::printf("%-22s %zu hits\n", what_.c_str(), hits.size());
  }

  // A helicoid, by a method: rays across it, and properties at hits and next to them. The truth is the closed form.
  void run_stream(const char* what, const StreamOptions& options) {
    what_ = what;
    const VectorField field = expression_flow({"-y", "x", "0.3"}, {glm::dvec3(-2), glm::dvec3(2)});
    const Interrogator query(device_, stream_surface(field, seed_expression({"u", "0", "0"}, {0.3, 1.2}), options));
    RayBatch rays(96);
    std::vector<float> height, radius;
    for (std::size_t i = 0; i < rays.size(); i++) {
      const float u = 0.32f + 0.009f * float(i), angle = 0.1f + 0.014f * float(i);
      rays.set(i, {{u * std::cos(angle), u * std::sin(angle), -1}, {0, 0, 1}});
      height.push_back(1 + 0.3f * angle);
      radius.push_back(u);
    }
    const HitList hits = query.cast(rays, {.hits = Hits::all, .tile = 64});
    expect(hits.size() == rays.size(), "one hit a ray");
    if (hits.size() != rays.size()) return;
    std::vector<float> u, gauss;
    for (std::size_t i = 0; i < rays.size(); i++) {
      u.push_back(hits.coordinates()[i].u);
      const double square = 0.09 + double(radius[i]) * double(radius[i]);
      gauss.push_back(float(-0.09 / (square * square)));
    }
    expect_close("t", difference(hits.t(), height), 2e-4);
    expect_close("u", difference(u, radius), 2e-4);
    expect_close("gauss", difference(hits.gauss_curvatures(), gauss), 1e-3);
    const PointProperties near = query.probe(hits.locations(), std::uint32_t(Property::location));
    double off = 0;
    for (std::size_t i = 0; i < hits.size(); i++)
      off = std::max(off, double(glm::distance(near.location[i], hits.locations()[i])));
    expect_close("nearest", off, 5e-4);
    std::printf("%-22s %zu hits\n", what_.c_str(), hits.size());
  }

  // Samples, and lines by both integrators with their variation, of a field and of a reconstruction of it.
  void run_flow(const char* what, const VectorField& field, int variation) {
    what_ = what;
    const Tracer query(device_, field), truth(reference_, field);
    const Bounds bounds = field.bounds();
    std::vector<glm::vec3> points;
    FlowSeeds seeds;
    for (int i = 0; i < 37; i++) {
      const glm::dvec3 part(0.2 + 0.6 * i / 36, 0.5 + 0.3 * std::sin(i), 0.5 + 0.3 * std::cos(2 * i));
      seeds.positions.push_back(glm::mix(bounds.lower, bounds.upper, part));
      seeds.tangents.emplace_back(1, 0, 0);
      points.emplace_back(seeds.positions.back());
    }
    points.emplace_back(bounds.upper + 1.0);
    const FlowSamples a = query.sample(points, variation), b = truth.sample(points, variation);
    expect(a.status == b.status, "status of samples");
    expect_close("vectors", difference(flat(a.value), flat(b.value)), tolerance(Quantity::value, kind));
    for (const Integrator integrator : {Integrator::rk4, Integrator::dormand_prince}) {
      const TraceOptions options{.time = 0.5,
                                 .both = true,
                                 .integrator = integrator,
                                 .step = 0.02,
                                 .tolerance = 1e-6,
                                 .interval = 0.1,
                                 .variation = variation};
      const Streamlines lines = query.trace(seeds, options), expected = truth.trace(seeds, options);
      expect(std::ranges::equal(lines.offsets, expected.offsets), "numbers of positions");
      expect(lines.end == expected.end, "ends of lines");
      if (lines.positions.size() == expected.positions.size())
        expect_close("positions", difference(flat(lines.positions), flat(expected.positions)),
                     2e-5);  // steps of 1e-6, that lines grow apart
    }
    std::printf("%-22s %zu lines\n", what_.c_str(), seeds.positions.size());
  }

  int failures() const { return failures_; }
  const DeviceInfo& info() const { return device_.info(); }

 private:
  static std::span<const float> flat(std::span<const glm::vec3> v) {
    return {v.empty() ? nullptr : &v[0].x, 3 * v.size()};
  }
  void expect(bool condition, const char* what) {
    if (condition) return;
    failures_++;
    std::fprintf(stderr, "%s: wrong: %s\n", what_.c_str(), what);
  }
  void expect_close(const char* quantity, double error, const Tolerance& allowed) {
    expect_close(quantity, error, allowed.value);
  }
  void expect_close(const char* quantity, double error, double allowed) {
    if (error <= allowed) return;
    failures_++;
    std::fprintf(stderr, "%s: %s differs from the reference by %g, allowed %g\n", what_.c_str(), quantity, error,
                 allowed);
  }
  // As many hits of each ray as the reference has, in the same places. Says whether there are as many.
  bool expect_hits(const HitList& hits, const HitList& expected, const RayBatch& rays,
                   HitStatus claim = HitStatus::isolated) {
    expect(std::ranges::equal(hits.offsets(), expected.offsets()), "numbers of hits");
    const auto match = [](const Ray&, const Hit& hit, const Root& root) {
      const double error = std::abs(hit.t - root.t) / std::max(1.0, std::abs(root.t));
      return Match{error / tolerance(Quantity::t, kind).value, error};
    };
    const Verdict verdict = judge(
        hits,
        HitListOracle(expected, {.match = match, .claim = claim, .doubtful_when_flagged = false, .unit = "relative"}),
        rays);
    if (verdict.failures() > 0) {
      failures_++;
      std::fprintf(stderr, "%s: %s; worst: ray %zu: %s\n", what_.c_str(), verdict.summary().c_str(), verdict.worst_ray,
                   verdict.worst.c_str());
    }
    return hits.size() == expected.size();
  }

  Device device_, reference_;
  std::string what_;
  int failures_ = 0;
};

}  // namespace
}  // namespace smurf::test

int main(int count, char** words) {
  using namespace smurf;
  using namespace smurf::test;
  if (count < 3) {
    std::fprintf(stderr, "usage: kernel-sweep DEVICE LANES [WHAT ...]\n");
    return 2;
  }
  try {
    Sweep sweep(words[1], std::stoi(words[2]));
    std::printf("on %s, %d lanes\n", sweep.info().name.c_str(), sweep.info().lanes);
    const std::vector<std::string> named(words + 3, words + count);
    const auto wanted = [&](const std::string& what) {
      return named.empty() || std::ranges::find(named, what) != named.end();
    };
    for (SampleType type : stored_types) {
      if (!wanted(name_of(type))) continue;
      for (Reconstruction r : {Reconstruction::trilinear, Reconstruction::tricubic, Reconstruction::catmull_rom})
        sweep.run(r, type);
    }
    const Domain domain{glm::dvec3(-1), glm::dvec3(1)};
    const BlackBox box{"FN real black_box(real x, real y, real z) { return x * x + 2.0f * y * y + z * z - 0.7f; }\n",
                       [](const glm::dvec3& p) { return p.x * p.x + 2 * p.y * p.y + p.z * p.z - 0.7; }, "ellipsoid"};
    if (wanted("mesh")) sweep.run_mesh();
    if (wanted("parametric")) {
      const ParametricScene scene = torus_scene(2, 1);
      sweep.run_parametric("parametric", scene.surface(), sources_of(scene));
    }
    if (wanted("nurbs")) {
      const std::vector<Patch> patches{nurbs_sphere(1)};
      sweep.run_parametric("nurbs", nurbs(patches), sources_of(patches));
    }
    if (wanted("flow")) {
      const glm::dvec3 size(1.5);
      sweep.run_flow("flow, expression", expression_flow({"-y", "x + 0.2*z", "0.3*cos(x)"}, {-size, size}), 2);
      const auto node = [](const glm::dvec3& p) { return glm::vec3(-p.y, p.x + 0.2 * p.z, 0.3 - 0.1 * p.x); };
      VectorGrid grid{glm::ivec3(5, 4, 6), {}, {}};
      CurvilinearBlock block{grid.size, {}, {}, {}};
      for (int k = 0; k < 6; k++)
        for (int j = 0; j < 4; j++)
          for (int i = 0; i < 5; i++) {
            const glm::dvec3 p(i - 2, j - 1.5, k - 2.5);
            grid.vectors.push_back(node(p));
            block.points.push_back(p + 0.1 * glm::dvec3(std::sin(p.y), std::sin(p.z), std::sin(p.x)));
            block.vectors.push_back(node(block.points.back()));
          }
      grid.placement.origin = glm::dvec3(-2, -1.5, -2.5);
      sweep.run_flow("flow, grid", grid_flow(grid), 1);
      sweep.run_flow("flow, tricubic grid", grid_flow(grid, VectorReconstruction::tricubic), 2);
      sweep.run_flow("flow, curvilinear", curvilinear_flow({block}), 1);
      sweep.run_flow("flow, tricubic", curvilinear_flow({block}, VectorReconstruction::tricubic), 2);
    }
    if (wanted("stream")) {
      const glm::dvec2 time(0, 1.5);
      sweep.run_stream("stream, cells", {.time = time, .tolerance = 2e-4});
      sweep.run_stream("stream, polished",
                       {.time = time, .tolerance = 2e-4, .derivatives = StreamDerivatives::integrated, .polish = true});
    }
    if (wanted("black-box")) sweep.run_black_box(implicit(box, domain));
    return sweep.failures() == 0 ? 0 : 1;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return error.code() == ErrorCode::usage ? 3 : 1;
  }
}
