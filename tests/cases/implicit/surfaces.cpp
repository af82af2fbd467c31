// Surfaces given by expressions: every root on every ray, on every device, against the reference; normals and
// curvatures; no hit where a function is undefined; closed forms.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>

#include "expression/evaluate.hpp"
#include "expression/files.hpp"
#include "harness/case.hpp"
#include "harness/compile_at_most.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/hit_list_oracle.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/tolerances.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "truth/rays.hpp"

KERNELS(implicit_models, grid_activate, grid_distances, find_hits, count_blocks, order_rows, measure);

namespace smurf::test {
namespace {

constexpr std::string_view kind = "implicit";
constexpr double flagged_part = tolerance(Quantity::flagged_rays, kind).value;  // where there are no singular points

constexpr std::uint32_t shape =
    Property::value | Property::normal | Property::gauss | Property::mean | Property::principal;

// Lines through two random points of the box, from outside of it.
RayBatch chords(const Bounds& box, std::size_t count, unsigned seed) {
  return random_chords(chords_of(box.lower, box.upper), count, seed);
}

// Where the ray is in the box.
std::pair<double, double> range_in(const Bounds& box, const Ray& ray) {
  double enter = ray.t_min, leave = ray.t_max;
  for (int axis = 0; axis < 3; axis++) {
    const double o = ray.origin[axis], d = ray.direction[axis];
    const double a = (box.lower[axis] - o) / d, b = (box.upper[axis] - o) / d;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return {enter, leave};
}

// The reference's hits as the roots. Where both have one, each may be off by its enclosure and by the rounding of t;
// twice as much counts as right.
HitListOracle oracle_of(const Surface& surface, const HitList& truth) {
  const Bounds bounds = surface.bounds();
  const auto rounding = [bounds](const Ray& ray) {
    return tolerance(Quantity::t, kind).value * 0x1p-24 * std::abs(range_in(bounds, ray).second);
  };
  const auto inside = [bounds](const Ray& ray, double t) {
    const auto [enter, leave] = range_in(bounds, ray);
    const double margin =
        tolerance(Quantity::border, kind).value * glm::length(bounds.upper - bounds.lower) / glm::length(ray.direction);
    return t >= enter + margin && t <= leave - margin;
  };
  return HitListOracle(
      truth,
      {.match =
           [=](const Ray& ray, const Hit& hit, const Root& root) {
             const double allowed = hit.uncertainty + truth.uncertainty()[root.row] + rounding(ray);
             const double off = std::abs(hit.t - root.t) / (2 * allowed);
             return off <= 1 ? Match{off, off} : Match{};
           },
       .certain = [=](const Ray& ray, std::span<const Root> roots, std::size_t k) { return inside(ray, roots[k].t); },
       .excused = [=](const Ray& ray, const Hit& hit) { return !inside(ray, hit.t); },
       .rounding = rounding});
}

// A case without its rays.
Case case_of(const std::string& name, const Surface& surface) {
  return {.name = name, .surface = surface, .replay = [](const std::string&, const Ray& ray, const std::string&) {
            return fmt::format("origin {} {} {}, direction {} {} {}", ray.origin.x, ray.origin.y, ray.origin.z,
                               ray.direction.x, ray.direction.y, ray.direction.z);
          }};
}

void compare_roots(const std::string& name, const Surface& surface, const TestDevice& device, const RayBatch& rays,
                   const HitList& mine, const HitList& truth, double most_flagged) {
  const Verdict verdict = expect_hits(case_of(name, surface), "rays", rays, oracle_of(surface, truth), device, mine);
  std::cout << "  " << name << ", " << device.label << ": " << verdict.summary() << "\n";
  EXPECT_LE(double(verdict.flagged_rays), most_flagged * double(rays.size()) + 1) << name << ", " << device.label;
  EXPECT_GT(verdict.roots, rays.size() / 50) << name << ": the rays show nothing";
}

// The reference measures at the very locations that the device measured at.
void compare_shapes(const std::string& name, const TestDevice& device, const HitList& mine,
                    const Interrogator& reference) {
  const PointProperties& a = mine.properties(shape);
  const PointProperties b = reference.probe(mine.locations(), shape);
  const PointErrors errors = compare_points(
      a, mine.locations(), mine.size(), [&](std::size_t i, const glm::dvec3&) -> std::optional<PointTruth> {
        if ((a.status[i] & PointStatus::undefined) || (b.status[i] & PointStatus::undefined)) return {};
        PointTruth truth{
            .exact = {.normal = b.normal[i], .k1 = b.k1[i], .k2 = b.k2[i], .gauss = b.gauss[i], .mean = b.mean[i]},
            .normal = tolerance(Quantity::normal, kind).value};
        const double size = std::max(std::abs(b.k1[i]), std::abs(b.k2[i]));
        if (size < tolerance(Quantity::curvature_floor, kind).value) return truth;
        truth.mean = truth.principal = tolerance(Quantity::curvature, kind).value * size;
        truth.gauss = truth.mean * size;
        return truth;
      });
  std::cout << "    " << errors.compared << " of " << mine.size() << " points, error / tolerance:" << errors.summary()
            << "\n";
  EXPECT_GT(errors.compared, mine.size() * 9 / 10) << name;
  expect_points(errors, mine.locations(), name + ", " + device.label);
}

void run(const std::string& name, const Surface& surface, std::size_t count, bool smooth = true) {
  const RayBatch rays = chords(surface.bounds(), count, 17);
  const Interrogator reference(reference_device(), surface);
  const HitList truth = reference.cast(rays, {.hits = Hits::all});
  for (TestDevice& device : one_of_each()) {
    if (device.name == "reference") continue;
    const Interrogator query(device.device, surface);
    const HitList all = query.cast(rays, {.hits = Hits::all});
    compare_roots(name, surface, device, rays, all, truth, flagged_part);
    if (smooth) compare_shapes(name, device, all, reference);
    expect_first(all, query.cast(rays, {.hits = Hits::first}), name + ", " + device.label);
  }
}

Domain box(double half) { return {glm::dvec3(-half), glm::dvec3(half)}; }

TEST(ImplicitSurfaces, Tanglecube) { run("tanglecube", implicit("x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", box(3)), 4000); }

TEST(ImplicitSurfaces, Gyroid) { run("gyroid", implicit("sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)", box(4)), 3000); }

// Along diagonals rays leave the cube that they may step out of through its edges and corners, to a rounding.
TEST(ImplicitSurfaces, RaysAlongAxesAndDiagonals) {
  const Surface surface = implicit("sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)", box(4));
  std::mt19937 random(23);
  std::uniform_real_distribution<float> place(-4, 4);
  std::uniform_int_distribution<int> cell(-64, 64);
  std::vector<Ray> list;
  for (int number = 0; number < 27; number++) {
    const glm::vec3 direction(number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1);
    if (direction == glm::vec3(0)) continue;
    for (int i = 0; i < 150; i++) {
      // Through any place, through corners of cells, and a rounding off the diagonal.
      const glm::vec3 through = i % 3 == 0 ? glm::vec3(cell(random), cell(random), cell(random)) / 16.0f
                                           : glm::vec3(place(random), place(random), place(random));
      glm::vec3 along = direction;
      if (i % 3 == 2) along[i / 3 % 3] *= 1 + (i % 2 == 0 ? 0x1p-23f : -0x1p-22f);
      list.push_back({through - 10.0f * along, along});
    }
  }
  const RayBatch rays(list);
  const HitList truth = Interrogator(reference_device(), surface).cast(rays, {.hits = Hits::all});
  for (const TestDevice& device : test_devices()) {
    const HitList all = Interrogator(device.device, surface).cast(rays, {.hits = Hits::all});
    compare_roots("gyroid along diagonals", surface, device, rays, all, truth, 0.02);
  }
}

TEST(ImplicitSurfaces, BarthSextic) {
  run("Barth sextic",
      implicit("4*(t^2*x^2-y^2)*(t^2*y^2-z^2)*(t^2*z^2-x^2)-(1+2*t)*(x^2+y^2+z^2-1)^2",
               {glm::dvec3(-2), glm::dvec3(2), 2}, {{"t", 1.618033988749895}}),
      3000, false);
}

TEST(ImplicitSurfaces, CutsAndRoots) {
  run("cut", implicit("max(sqrt(x^2+y^2+z^2)-1.5, -(abs(x)+abs(y)+abs(z)-1.7))", box(2)), 3000, false);
}

// Cells that a crease crosses have a model of each side where the function is the greater or the lesser of both, and
// none elsewhere.
TEST(ImplicitSurfaces, MinimaAndMaxima) {
  const char* gyroid = "max(sin(6*x)*cos(6*y)+sin(6*y)*cos(6*z)+sin(6*z)*cos(6*x), x^2+y^2+z^2-1)";
  run("gyroid in a sphere", implicit(gyroid, box(1.1)), 1000, false);
  const char* nested = "min(max(max(x^2+y^2+z^2-1, 0.1*sin(9*x)-z), 0.3-sqrt(x^2+y^2)), (x-0.8)^2+y^2+z^2-0.2) - 0.05";
  run("minimum of maxima", implicit(nested, box(1.5)), 1000, false);
  run("shell", implicit("abs(x^2+y^2+z^2-1)-0.1", box(1.5)), 500, false);
  run("edges of a cube", implicit("max(max(abs(x), abs(y)), abs(z))-1", box(1.25)), 500, false);
  // Here it falls with what the maximum is of, takes its square, and turns on one difference in two ways.
  run("falling", implicit("1.5-max(x^2+y^2, abs(z)+0.5*x)", box(1.5)), 500, false);
  run("squared", implicit("(max(x, y)-0.2)^2+z^2-0.5", box(1.5)), 500, false);
  run("both ways", implicit("max(x^2, y)-2*min(x^2, y)+z", box(1.5)), 500, false);
  run("turned around", implicit("max(max(x^2, y)-0.5, 0.3*min(y, x^2)+z)", box(1.5)), 500, false);
}

TEST(ImplicitSurfaces, IsosurfacesOfExpressions) {
  const Surface surface = isosurface("exp(-(x^2+y^2+2*z^2))+0.5*exp(-((x-1)^2+y^2+z^2))", 0.3, box(2.5));
  EXPECT_EQ(surface.kind(), "isosurface");
  run("blobs", surface, 3000);
  // Out of the denser side.
  for (TestDevice& device : one_of_each()) {
    const PointProperties p = Interrogator(device.device, surface).probe(std::vector{glm::vec3(-1, 0, 0)}, shape);
    EXPECT_LT(p.normal[0].x, -0.99f) << device.label;
    EXPECT_NEAR(p.value[0], std::exp(-1.0) + 0.5 * std::exp(-4.0), 1e-6) << device.label;
  }
}

struct Sheet {
  const char* equation;
  std::size_t hits;  // along x through y = 0.3, z = 0.2
};

void expect_hits_of(const std::vector<Sheet>& sheets) {
  for (const Sheet& sheet : sheets) {
    const Surface surface = implicit(sheet.equation, box(2.5));
    RayBatch rays(1);
    rays.set(0, {{-3.1f, 0.3f, 0.2f}, {1, 0, 0}});
    for (TestDevice& device : one_of_each()) {
      const HitList hits = Interrogator(device.device, surface).cast(rays, {.hits = Hits::all});
      EXPECT_EQ(hits.size(), sheet.hits) << sheet.equation << ", " << device.label;
      for (HitStatus status : hits.status())
        EXPECT_EQ(status, HitStatus::isolated) << sheet.equation << ", " << device.label;
    }
  }
}

TEST(ImplicitSurfaces, NothingWhereAFunctionIsUndefined) {
  expect_hits_of({{"1/x", 0},
                  {"tan(x)", 1},
                  {"log(x)", 1},
                  {"sqrt(x)-1", 1},
                  {"1/x-1", 1},
                  {"(x^2-1)/(x-1)", 1},
                  {"log(-2-x^2)", 0},
                  {"asin(x)-0.5", 1}});
}

TEST(ImplicitSurfaces, SpheresInClosedForm) {
  for (TestDevice& device : one_of_each()) {
    Interrogator query(device.device, implicit("x^2+y^2+z^2-4", box(3)));
    RayBatch rays(3);
    rays.set(0, {{-5, 0.5f, 0.25f}, {1, 0, 0}});
    rays.set(1, {{-5, 2, 0}, {1, 0, 0}});  // touches
    rays.set(2, {{0, 0, 0}, {0, 0, 2}});   // from inside, not normalised
    const HitList hits = query.cast(rays, {.hits = Hits::all, .properties = shape});
    ASSERT_EQ(hits.offsets()[1], 2u) << device.label;
    const double half = std::sqrt(4 - 0.25 - 0.0625);
    EXPECT_NEAR(hits.t()[0], 5 - half, 2e-6) << device.label;
    EXPECT_NEAR(hits.t()[1], 5 + half, 2e-6) << device.label;
    EXPECT_NEAR(hits.properties(shape).k1[0], 0.5, 1e-6) << device.label;
    EXPECT_NEAR(hits.properties(shape).gauss[0], 0.25, 1e-6) << device.label;
    EXPECT_LT(hits.normals()[0].x, 0) << device.label;
    ASSERT_EQ(hits.offsets()[2], 3u) << device.label;
    EXPECT_NE(hits.status()[2], HitStatus::isolated) << device.label;
    EXPECT_LE(std::abs(hits.t()[2] - 5), hits.uncertainty()[2]) << device.label;
    ASSERT_EQ(hits.offsets()[3], 4u) << device.label;
    EXPECT_NEAR(hits.t()[3], 1, 1e-6) << device.label;
  }
}

TEST(ImplicitSurfaces, BadEquationsAreRefused) {
  const auto refused = [](auto make, const std::string& fragment) {
    try {
      make();
      ADD_FAILURE() << "accepted; expected: " << fragment;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  };
  refused([] { implicit("x+*y", box(1)); }, "column 3");
  refused([] { implicit("x+w", box(1)); }, "w");
  refused([] { implicit("x", {glm::dvec3(1), glm::dvec3(-1)}); }, "domain");
  refused([] { isosurface("x", std::nan(""), box(1)); }, "isovalue");
}

TEST(ImplicitSurfaces, LongExpressionsAreInterpreted) {
  // Many blobs: more than a compiler can be asked to take.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::string text = "-0.4";
  for (int i = 0; i < 50; i++) {
    const auto offset = [&] { return std::to_string(unit(random)); };
    text += "+exp(-12*((x-(" + offset() + "))^2+(y-(" + offset() + "))^2+(z-(" + offset() + "))^2))";
  }
  const Surface surface = implicit(text, box(1.25));
  const RayBatch rays = chords(surface.bounds(), 400, 17);
  const Interrogator reference(reference_device(), surface);
  const HitList truth = reference.cast(rays, {.hits = Hits::all});
  for (TestDevice& device : one_of_each()) {
    if (device.name == "reference") continue;
    try {
      const HitList hits = Interrogator(device.device, surface).cast(rays, {.hits = Hits::all});
      compare_roots("blobs, interpreted", surface, device, rays, hits, truth, flagged_part);
      compare_shapes("blobs, interpreted", device, hits, reference);
    } catch (const Error& error) {
      // Never in silence: llvmpipe has no patience for five hundred operations, many times over.
      EXPECT_NE(device.device.info().name.find("llvmpipe"), std::string::npos) << error.what();
      EXPECT_EQ(error.code(), ErrorCode::device) << error.what();
      EXPECT_NE(std::string(error.what()).find("65,535"), std::string::npos) << error.what();
    }
  }
}

TEST(ImplicitSurfaces, InterpretedAsCompiled) {
  const CompileAtMost none("0");
  run("gyroid, interpreted", implicit("sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)", box(4)), 500);
  run("cut, interpreted", implicit("max(sqrt(x^2+y^2+z^2)-1.5, -(abs(x)+abs(y)+abs(z)-1.7))", box(2)), 500, false);
  // Every operation, where all are defined and smooth.
  const Surface all = implicit(
      "atan2(y, x)+tan(0.3*z)*asin(0.4*x)-acos(0.3*y)+atan(x*z)+sinh(0.5*y)+cosh(0.4*z)*tanh(x)+exp(-x)/log(x+1.5)"
      "+(x+0.1)^y-z^3+x^1.5+mod(x,7)+floor(0.1*y)+max(x,9)+min(y,-9)+abs(z-5)+sqrt(x+y)-x^(-2)",
      {glm::dvec3(0.5), glm::dvec3(1.5)});
  const Interrogator reference(reference_device(), all);
  std::vector<glm::vec3> points;
  std::mt19937_64 random(6);
  std::uniform_real_distribution<float> inside(0.55f, 1.45f);
  for (int i = 0; i < 200; i++) points.emplace_back(inside(random), inside(random), inside(random));
  const PointProperties truth = reference.probe(points, shape);
  for (TestDevice& device : one_of_each()) {
    const PointProperties found = Interrogator(device.device, all).probe(points, shape);
    for (std::size_t i = 0; i < points.size(); i++) {
      ASSERT_EQ(found.status[i] & PointStatus::undefined, 0u) << device.label << ", point " << i;
      // A few dozen operations, of sizes up to 20.
      EXPECT_NEAR(found.value[i], truth.value[i], 4e-5) << device.label << ", point " << i;
    }
    const PointErrors errors = compare_points(found, points, points.size(), [&](std::size_t i, const glm::dvec3&) {
      constexpr std::string_view every = "implicit, every operation";
      const double size = std::max({1.0f, std::abs(truth.k1[i]), std::abs(truth.k2[i])});
      return PointTruth{.exact = {.normal = truth.normal[i], .k1 = truth.k1[i], .k2 = truth.k2[i]},
                        .normal = tolerance(Quantity::normal, every).value,
                        .principal = tolerance(Quantity::curvature, every).value * size};
    });
    expect_points(errors, points, "every operation, " + device.label);
  }
}

TEST(ImplicitSurfaces, NothingWhereAnInterpretedFunctionIsUndefined) {
  const CompileAtMost none("0");
  expect_hits_of({{"1/x", 0}, {"1/x-1", 1}, {"(x^2-1)/(x-1)", 1}, {"sqrt(x)-1", 1}});
}

// A tape of thousands of operations, where the development data is at hand.
TEST(ImplicitSurfaces, Tapes) {
  const std::filesystem::path file = shared_data("implicit/prospero.vm");
  if (!has_shared_data("implicit/prospero.vm")) GTEST_SKIP() << "LongExpressionsAreInterpreted stands for it";
  const Surface surface = load_implicit(file, Domain{glm::dvec3(-1, -1, -0.25), glm::dvec3(1, 1, 0.25)});
  const RayBatch rays = chords(surface.bounds(), 60, 29);
  TestDevice* device = test_device("opencl");
  ASSERT_NE(device, nullptr);
  const HitList hits = Interrogator(device->device, surface).cast(rays, {.hits = Hits::all});
  // Held against signs in double precision: a change between two samples has a hit between them, and an isolated hit is
  // a change.
  const expression::ImplicitFile tape = expression::load_vm(file);
  const expression::Evaluator evaluator(tape.graph, std::span(&tape.root, 1));
  std::vector<double> scratch;
  std::size_t changes = 0, crossings = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const Ray ray = rays[i];
    const auto value = [&](double t) {
      const glm::dvec3 p = glm::dvec3(ray.origin) + t * glm::dvec3(ray.direction);
      double result = 0;
      evaluator(std::array{p.x, p.y, p.z}, std::span(&result, 1), scratch);
      return result;
    };
    const auto [enter, leave] = range_in(surface.bounds(), ray);
    const std::size_t begin = hits.offsets()[i], end = hits.offsets()[i + 1];
    const double step = (leave - enter) / 1500, rounding = 1e-6 * leave;
    for (double t = enter; t + step < leave; t += step) {
      if (value(t) * value(t + step) >= 0) continue;
      changes++;
      const bool found = std::any_of(hits.t().begin() + std::ptrdiff_t(begin), hits.t().begin() + std::ptrdiff_t(end),
                                     [&](float hit) { return hit >= t - rounding && hit <= t + step + rounding; });
      EXPECT_TRUE(found) << "ray " << i << ", between " << t << " and " << t + step;
    }
    for (std::size_t h = begin; h < end; h++) {
      if (hits.status()[h] != HitStatus::isolated) continue;
      crossings++;
      const double off = hits.uncertainty()[h] + rounding;
      EXPECT_LT(value(hits.t()[h] - off) * value(hits.t()[h] + off), 0) << "ray " << i << ", t " << hits.t()[h];
    }
  }
  std::cout << "  prospero: " << changes << " changes of sign, " << crossings << " isolated hits\n";
  EXPECT_GT(changes, 20u);
  EXPECT_GE(crossings, changes * 9 / 10);
}

// Two spheres that meet in the plane 1.5x = y - 0.0625; min and max are the same but for signs.
constexpr const char* lens = "-1.25-min(-((x-0.5)^2+y^2+z^2),-((x+0.25)^2+(y-0.5)^2+z^2))";

// Points of which it is certain, in floats, which side they are on or that they are on both.
TEST(ImplicitSurfaces, CreasesSaySo) {
  struct Place {
    glm::vec3 point;
    bool crease;
    glm::vec3 normal;  // of the side that graph.hpp promises
  };
  struct Creased {
    const char* equation;
    std::vector<Place> places;
  };
  const float third = 1 / std::sqrt(3.0f);
  const std::vector<Creased> surfaces = {
      // Faces, among them where one of the other coordinates folds; edges; corners.
      {"max(max(abs(x),abs(y)),abs(z))-1",
       {{{1, 0.3f, 0.2f}, false, {1, 0, 0}},
        {{1, 0, 0}, false, {1, 0, 0}},
        {{-0.25f, 0, -1}, false, {0, 0, -1}},
        {{0.5f, -1, 0.999f}, false, {0, -1, 0}},
        {{1, 1, 0.5f}, true, {1, 0, 0}},
        {{1, 1, 0}, true, {1, 0, 0}},
        {{0.25f, -1, 1}, true, {0, -1, 0}},
        {{1, 1, 1}, true, {1, 0, 0}},
        {{-1, 1, -1}, true, {-1, 0, 0}}}},
      // One fold beside another, none of them with a gradient of its own in the middle; beside a fold.
      {"abs(x)+abs(y)+abs(z)-1",
       {{{0.25f, 0.5f, -0.25f}, false, {third, third, -third}},
        {{0, 0.5f, 0.5f}, true, {third, third, third}},
        {{0, 0, -1}, true, {third, third, -third}},
        {{0, 0, 0}, true, {third, third, third}},
        {{1e-6f, 0.5f, 0.5f}, false, {third, third, third}},
        {{-1e-30f, 0.5f, 0.5f}, false, {-third, third, third}}}},
      {lens,
       {{{0.5f, 0.8125f, 0}, true, {0, 1, 0}},
        {{0.5f, 0.8125f, 0.8125f}, true, {0, std::sqrt(0.5f), std::sqrt(0.5f)}},
        {{0.5f, -0.5f, 0}, false, {0.6f, -0.8f, 0}}}},
      // What turns nothing: a crease within another argument of a maximum, sides that go on alike, a factor that
      // vanishes, and less than can be seen.
      {"y+max(x+9,min(y,z))+max(y,y+z*z)+x*abs(x)+0.0001*abs(z)",
       {{{0, 0.5f, 0.5f}, false, {1, 2, 1}}, {{0, 0.5f, 0}, false, {1, 2, 0}}, {{0.25f, 0, 0}, false, {1.5f, 2, 0}}}},
  };
  for (const Creased& creased : surfaces) {
    const Surface surface = implicit(creased.equation, box(2));
    std::vector<glm::vec3> points;
    for (const Place& place : creased.places) points.push_back(place.point);
    for (TestDevice& device : one_of_each()) {
      const PointProperties found = Interrogator(device.device, surface).probe(points, shape);
      for (std::size_t i = 0; i < points.size(); i++) {
        const Place& place = creased.places[i];
        const std::string at = std::string(creased.equation) + ", point " + std::to_string(i) + ", " + device.label;
        EXPECT_EQ((found.status[i] & PointStatus::crease) != 0, place.crease) << at;
        EXPECT_FALSE(found.status[i] & PointStatus::undefined) << at;
        EXPECT_LT(glm::distance(found.normal[i], glm::normalize(place.normal)), 2e-4f) << at;
        EXPECT_TRUE(std::isfinite(found.mean[i])) << at;
      }
    }
  }
  // Where no side has a gradient there is no crease either.
  const Surface flat = implicit("x*abs(x)+max(y^2+z^2,-y^2-z^2)", box(2));
  for (TestDevice& device : one_of_each()) {
    EXPECT_EQ(Interrogator(device.device, flat).probe(std::vector{glm::vec3(0)}, shape).status[0],
              PointStatus::undefined)
        << device.label;
  }
}

// Few floats are on the plane in which two spheres meet. What is well off it is no crease, what is on it to double
// precision is one; in between each executor has its own rounding.
TEST(ImplicitSurfaces, CreasesByRounding) {
  const auto apart = [](const glm::dvec3& p) { return std::abs(1.5 * p.x - p.y + 0.0625); };
  const Surface surface = implicit(lens, box(2));
  std::vector<glm::vec3> points;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 2000; i++) {
    const double y = 2 * unit(random) - 1, z = 2 * unit(random) - 1, off = std::pow(10.0, -9 + 5 * unit(random));
    points.emplace_back(float((y - 0.0625) / 1.5 + off), float(y), float(z));
  }
  const PointProperties truth = Interrogator(reference_device(), surface).probe(points, shape);
  for (TestDevice& device : one_of_each()) {
    const PointProperties found = Interrogator(device.device, surface).probe(points, shape);
    std::size_t creases = 0, others = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      const bool open = (found.status[i] & PointStatus::crease) != 0;
      creases += open;
      others += open != ((truth.status[i] & PointStatus::crease) != 0);
      // Floats round the difference of numbers up to 4 a dozen times.
      const double off = apart(points[i]);
      if (off > 5e-6) {
        EXPECT_FALSE(open) << device.label << ", point " << i << ": " << off;
      }
      if (off < 1e-9) {
        EXPECT_TRUE(open) << device.label << ", point " << i << ": " << off;
      }
    }
    std::cout << "  " << device.label << ": " << creases << " creases, " << others << " unlike the reference\n";
    EXPECT_GT(creases, points.size() / 10) << device.label;
    EXPECT_LT(creases, points.size() * 9 / 10) << device.label;
    EXPECT_LT(others, points.size() / 20) << device.label;
  }
}

// Writes a file into the tests' output folder.
std::string written(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(SMURF_TEST_OUTPUT) / name;
  std::ofstream(file) << text;
  return file.string();
}

TEST(ImplicitSurfaces, Descriptions) {
  written("two-planes.jsurf", "surface_equation=(x-a)*(x+a)\nsurface_parameter_a=1.5\n");
  const Surface algebraic =
      load_surface(written("algebraic.json", R"j({"kind":"implicit","file":"two-planes.jsurf"})j"));
  EXPECT_EQ(algebraic.bounds().upper, glm::dvec3(5)) << "a ball of radius 5 unless told otherwise";
  const Surface smaller =
      load_surface(written("smaller.json", R"j({"kind":"implicit","file":"two-planes.jsurf","radius":2})j"));
  const Surface named = load_surface(
      written("named.json",
              R"j({"kind":"implicit","equation":"(x-a)*(x+a)","parameters":{"a":1.5},"domain":[[-2,-2,-2],[2,2,2]]
})j"));
  RayBatch rays(1);
  rays.set(0, {{-9, 0.3f, 0.2f}, {1, 0, 0}});
  for (TestDevice& device : one_of_each()) {
    for (const Surface& surface : {algebraic, smaller, named}) {
      const HitList hits = Interrogator(device.device, surface).cast(rays, {.hits = Hits::all});
      ASSERT_EQ(hits.size(), 2u) << device.label;
      EXPECT_NEAR(hits.t()[0], 7.5, 2e-6) << device.label;
      EXPECT_NEAR(hits.t()[1], 10.5, 2e-6) << device.label;
    }
  }
  const auto refused = [](const std::string& text, const std::string& fragment) {
    try {
      load_surface(written("refused.json", text));
      ADD_FAILURE() << "accepted: " << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << text;
      EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  };
  refused(R"j({"kind":"implicit","equation":"x"})j", "\"domain\" is missing");
  refused(R"j({"kind":"implicit","domain":[[-1,-1,-1],[1,1,1]]})j", "\"equation\" is missing");
  refused(R"j({"kind":"implicit","equation":"x","file":"a.vm","domain":[[-1,-1,-1],[1,1,1]]})j", "exclude each other");
  refused(R"j({"kind":"implicit","equation":"x","domain":[[-1,-1],[1,1,1]]})j", "domain[0]");
  refused(R"j({"kind":"implicit","equation":"(x","domain":[[-1,-1,-1],[1,1,1]]})j", "column 3");
  refused(R"j({"kind":"implicit","equation":"a*x","parameters":{"a":"b"},"domain":[[-1,-1,-1],[1,1,1]]})j",
          "parameters.a");
  refused(R"j({"kind":"implicit","file":"missing.jsurf"})j", "missing.jsurf");
  refused(R"j({"kind":"isosurface","isovalue":1,"field":{"kind":"expression","value":"x"}})j", "field.domain");
}

}  // namespace
}  // namespace smurf::test
