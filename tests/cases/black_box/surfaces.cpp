// Black boxes: a user's own source against closed forms and against the same function as an expression, whose roots are
// proved; poles and jumps; pairs of roots between samples; derivatives by differences of each order; what is refused.
#include "smurf/black_box.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>

#include "harness/case.hpp"
#include "harness/devices.hpp"
#include "harness/hit_list_oracle.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/replay.hpp"
#include "harness/tolerances.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "truth/rays.hpp"

KERNELS(find_hits, count_blocks, order_rows, measure);

namespace smurf::test {
namespace {

constexpr double rounding = 0x1p-24;
constexpr std::string_view black_box = "black box";
constexpr double value_roundings = tolerance(Quantity::value, black_box).value;
constexpr std::uint32_t shape = Property::normal | Property::gauss | Property::mean | Property::principal;

std::string source_of(const std::string& value, const std::string& before = "") {
  return "FN real black_box(real x, real y, real z) {\n" + before + "  return " + value + ";\n}\n";
}

Domain cube(double half) { return {glm::dvec3(-half), glm::dvec3(half)}; }

struct Shape {
  std::string name, source, equation;
  double half;       // of the domain
  double magnitude;  // of the terms of f
  BlackBoxOptions options;
  std::function<double(const glm::dvec3&)> value;

  BlackBox box() const { return {source, value, name}; }
  Surface surface() const { return implicit(box(), cube(half), options); }
};

// Distances from balls in a row, by a loop.
const char* const balls_source = R"(
FN real balls_one(real x, real y, real z, int i) {
  real3 p = make3(x - (0.6f * i - 1.2f), y, z);
  return sqrt_real(dot3(p, p)) - 0.25f;
}
FN real black_box(real x, real y, real z) {
  real least = splat(9.0f);
  for (int i = 0; i < 5; i++) least = min_real(least, balls_one(x, y, z, i));
  return least;
}
)";
double balls_value(const glm::dvec3& p) {
  double least = 9;
  // The centres are rounded as on devices.
  for (int i = 0; i < 5; i++) {
    const double centre = double(0.6f * float(i) - 1.2f);
    least = std::min(least, glm::length(p - glm::dvec3(centre, 0, 0)) - 0.25);
  }
  return least;
}
const char* const balls_equation =
    "min(min(min(sqrt((x+1.2000000476837158)^2+y^2+z^2),sqrt((x+0.6)^2+y^2+z^2)),min(sqrt(x^2+y^2+z^2),"
    "sqrt((x-0.6)^2+y^2+z^2))),sqrt((x-1.2000000476837158)^2+y^2+z^2))-0.25";

double torus_value(const glm::dvec3& p) {
  const double around = std::hypot(p.x, p.y) - 1;
  return around * around + p.z * p.z - 0.16;
}

std::vector<Shape> shapes() {
  return {
      {"sphere",
       source_of("x * x + y * y + z * z - 1.0f"),
       "x^2+y^2+z^2-1",
       1.5,
       3,
       {},
       [](const glm::dvec3& p) { return glm::dot(p, p) - 1; }},
      {"torus",
       source_of("around * around + z * z - 0.16f", "  real around = sqrt_real(x * x + y * y) - 1.0f;\n"),
       "(sqrt(x^2+y^2)-1)^2+z^2-0.16",
       1.5,
       3,
       {},
       torus_value},
      {"gyroid",
       source_of("checked_sin(x) * checked_cos(y) + checked_sin(y) * checked_cos(z) + "
                 "checked_sin(z) * checked_cos(x)"),
       "sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)",
       5,
       6,
       {},
       [](const glm::dvec3& p) {
         return std::sin(p.x) * std::cos(p.y) + std::sin(p.y) * std::cos(p.z) + std::sin(p.z) * std::cos(p.x);
       }},
      {"balls", balls_source, balls_equation, 1.6, 3, {}, balls_value},
      {"balls by distance", balls_source, balls_equation, 1.6, 3, {.lipschitz = 1}, balls_value},
  };
}

// Lines through two random points of the cube, from outside of it; directions of any length.
RayBatch chords(double half, std::size_t count, unsigned seed) {
  return random_chords({.lower = glm::dvec3(-half), .upper = glm::dvec3(half), .before = 4 * half, .speeds = 4}, count,
                       seed);
}

glm::dvec3 at(const Ray& ray, double t) { return glm::dvec3(ray.origin) + t * glm::dvec3(ray.direction); }

std::vector<double> t_of(const HitList& hits, std::size_t ray) {
  return {hits.t().begin() + std::ptrdiff_t(hits.offsets()[ray]),
          hits.t().begin() + std::ptrdiff_t(hits.offsets()[ray + 1])};
}

std::string written(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(SMURF_TEST_OUTPUT) / name;
  std::ofstream(file) << text;
  return file.string();
}

// The roots of a shape, which are those of the same function as an expression: where hits are looked for by samples.
class ShapeRoots {
 public:
  explicit ShapeRoots(const Shape& shape)
      : shape_(shape),
        step_(shape.options.step > 0 ? shape.options.step : 2 * std::sqrt(3.0) * shape.half / 512),
        case_{.name = shape.name,
              .surface = shape.surface(),
              .replay = [shape](const std::string& name, const Ray& ray, const std::string& device) {
                written("replayed.inc", shape.source);
                return replay_command(
                    name,
                    fmt::format(
                        "{{\"kind\":\"implicit\",\"source\":\"replayed.inc\",\"equation\":\"{}\","
                        "\"domain\":[[{},{},{}],[{},{},{}]]{}}}\n",
                        shape.equation, -shape.half, -shape.half, -shape.half, shape.half, shape.half, shape.half,
                        shape.options.lipschitz > 0 ? fmt::format(",\"lipschitz\":{}", shape.options.lipschitz) : ""),
                    ray, device);
              }} {}

  HitListOracle oracle(const RayBatch& rays) const {
    const Surface same = implicit(shape_.equation, cube(shape_.half));
    return HitListOracle(Interrogator(reference_device(), same).cast(rays, {.hits = Hits::all}),
                         {.match =
                              [this](const Ray& ray, const Hit& hit, const Root& root) {
                                const double off = std::abs(root.t - hit.t) / allowed(ray, root.t, hit.t);
                                return off <= 1 ? Match{off, off} : Match{};
                              },
                          // Pairs closer than a step may be stepped over.
                          .certain =
                              [this](const Ray& ray, std::span<const Root> roots, std::size_t k) {
                                const double t = roots[k].t,
                                             gap = 1.01 * step_ / glm::length(glm::dvec3(ray.direction));
                                return !((k > 0 && t - roots[k - 1].t < gap) ||
                                         (k + 1 < roots.size() && roots[k + 1].t - t < gap) || outside(at(ray, t)));
                              },
                          .excused = [this](const Ray& ray, const Hit& hit) { return outside(at(ray, hit.t)); },
                          .claim = HitStatus::bracketed,
                          .doubtful_when_flagged = false});
  }

  void expect(const HitList& hits, const RayBatch& rays, const HitListOracle& oracle, const TestDevice& device) const {
    for (const HitStatus status : hits.status()) ASSERT_EQ(status, HitStatus::bracketed);
    const Verdict verdict = expect_hits(case_, "chords", rays, oracle, device, hits);
    for (std::size_t i = 0; i < rays.size(); i++)
      EXPECT_LE(t_of(hits, i).size(), t_of(oracle.truth(), i).size() + 1) << device.label << ": ray " << i;
    EXPECT_GT(verdict.roots, rays.size() / 4);
    std::cout << "  " << shape_.name << ", " << device.label << ": " << verdict.summary() << "\n";
  }

 private:
  bool outside(const glm::dvec3& p) const {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > shape_.half * (1 - border);
  }
  // What rounding moves the root by: that of t and of the coordinates, and that of f over its slope.
  double allowed(const Ray& ray, double t, double other) const {
    const double speed = glm::length(glm::dvec3(ray.direction)), h = 1e-5 / speed;
    const double slope = std::abs(shape_.value(at(ray, t + h)) - shape_.value(at(ray, t - h))) / (2 * h);
    const double places = tolerance(Quantity::t, black_box).value * rounding * (std::abs(other) + shape_.half / speed);
    // Near a double root f = slope·x + bend·x²/2 is what rounds.
    const double noise = value_roundings * rounding * shape_.magnitude;
    return places + std::min(noise / slope, std::sqrt(noise) / speed * 2);
  }

  static constexpr double border = tolerance(Quantity::border, black_box).value;
  const Shape& shape_;
  double step_;
  Case case_;
};

TEST(BlackBox, RootsOfExpressions) {
  for (const Shape& shape : shapes()) {
    const RayBatch all = chords(shape.half, 1500, 3), few = chords(shape.half, 200, 4);
    const ShapeRoots roots(shape);
    const HitListOracle oracle = roots.oracle(all), oracle_of_few = roots.oracle(few);
    roots.expect(Interrogator(reference_device(), shape.surface()).cast(few, {.hits = Hits::all}), few, oracle_of_few,
                 {"reference", "reference", 0, false, reference_device()});
    for (TestDevice& device : test_devices()) {
      const RayBatch& rays = device.slow ? few : all;
      const Interrogator query(device.device, shape.surface());
      const HitList hits = query.cast(rays, {.hits = Hits::all});
      roots.expect(hits, rays, device.slow ? oracle_of_few : oracle, device);
      expect_first(hits, query.cast(rays, {.hits = Hits::first}), shape.name + ", " + device.label);
    }
  }
}

// Chords of a sphere that are shorter than a step, at every place between two samples.
TEST(BlackBox, PairsBetweenSamples) {
  const double half = 1.5, step = 2 * std::sqrt(3.0) * half / 512;
  for (const auto& [source, magnitude] :
       {std::pair{source_of("x * x + y * y + z * z - 1.0f"), 3.0}, {source_of("1.0f - x * x - y * y - z * z"), 3.0}}) {
    RayBatch rays(64);
    std::vector<double> reach;
    for (std::size_t i = 0; i < rays.size(); i++) {
      reach.push_back(step * (0.1 + 0.3 * double(i % 8) / 8));  // half of the chord
      const double y = std::sqrt(1 - reach.back() * reach.back());
      rays.set(i, {glm::vec3(-3 + 0.013f * float(i), float(y), 0), glm::vec3(1, 0, 0)});
      const double stored = float(y);
      reach.back() = std::sqrt(1 - stored * stored);
    }
    for (TestDevice& device : test_devices()) {
      const HitList hits =
          Interrogator(device.device, implicit(BlackBox{source, {}}, cube(half))).cast(rays, {.hits = Hits::all});
      for (std::size_t i = 0; i < rays.size(); i++) {
        const std::vector<double> t = t_of(hits, i);
        ASSERT_EQ(t.size(), 2u) << device.label << ", ray " << i;
        const double allowed = value_roundings * rounding * magnitude / (2 * reach[i]) + 1e-6;
        EXPECT_NEAR(t[0] + double(rays[i].origin.x), -reach[i], allowed) << device.label << ", ray " << i;
        EXPECT_NEAR(t[1] + double(rays[i].origin.x), reach[i], allowed) << device.label << ", ray " << i;
      }
    }
  }
}

// A bound on the gradient is believed: where it is wrong, what it says cannot be is stepped over.
TEST(BlackBox, StepsAreAsLongAsTheBoundAllows) {
  const std::string dent = source_of("min_real(splat(1.0f), 100.0f * abs_real(x - 0.3f) - 1.0f)");
  RayBatch rays(16);
  for (std::size_t i = 0; i < rays.size(); i++)
    rays.set(i, {glm::vec3(-2 - 0.0137f * float(i), 0.3f, 0.2f), glm::vec3(1 + float(i), 0, 0)});
  for (TestDevice& device : test_devices()) {
    const auto count = [&](double lipschitz) {
      const Surface surface = implicit(BlackBox{dent, {}}, cube(1), {.lipschitz = lipschitz});
      return Interrogator(device.device, surface).cast(rays, {.hits = Hits::all}).size();
    };
    EXPECT_EQ(count(0), 2 * rays.size()) << device.label;
    EXPECT_EQ(count(100), 2 * rays.size()) << device.label;
    EXPECT_EQ(count(1), 0u) << device.label;
  }
}

// Sources that were written before functions had the names of expressions (kernels/black_box/words.inc).
TEST(BlackBox, FormerWordsMeanTheSame) {
  const std::string former = source_of(
      "greater(lesser(x, y), absolute(z)) + square_root(dot3(p, p)) + checked_sine(x) + checked_cosine(y) + "
      "checked_tangent(0.1f * z) + checked_arcsine(0.1f * x) + checked_arccosine(0.1f * y) + checked_arctangent2(x, w) "
      "+ "
      "checked_logarithm(w) + checked_square_root(w) + checked_power(w, y) + checked_modulo(x, w) + "
      "checked_minimum(x, z) + checked_maximum(y, z) + function_exponential(x) + function_arctangent(y) + "
      "function_hyperbolic_sine(0.1f * z) + function_hyperbolic_cosine(0.1f * x) + function_hyperbolic_tangent(y) - "
      "8.0f",
      "  real3 p = absolute3(make3(x, y, z));\n  real w = 2.0f + x;\n");
  const std::string present = source_of(
      "max_real(min_real(x, y), abs_real(z)) + sqrt_real(dot3(p, p)) + checked_sin(x) + checked_cos(y) + "
      "checked_tan(0.1f * z) + checked_asin(0.1f * x) + checked_acos(0.1f * y) + checked_atan2(x, w) + "
      "checked_log(w) + checked_sqrt(w) + checked_pow(w, y) + checked_mod(x, w) + "
      "checked_min(x, z) + checked_max(y, z) + function_exp(x) + function_atan(y) + "
      "function_sinh(0.1f * z) + function_cosh(0.1f * x) + function_tanh(y) - 8.0f",
      "  real3 p = abs3(make3(x, y, z));\n  real w = 2.0f + x;\n");
  const RayBatch rays = chords(1, 200, 3);
  for (TestDevice& device : one_of_each()) {
    if (device.device.is_reference()) continue;  // it knows no source
    const auto hits = [&](const std::string& source) {
      return Interrogator(device.device, implicit(BlackBox{source, {}}, cube(1))).cast(rays, {.hits = Hits::all});
    };
    const HitList a = hits(former), b = hits(present);
    EXPECT_GT(a.size(), 50u) << device.label;
    EXPECT_TRUE(std::ranges::equal(a.t(), b.t())) << device.label;
  }
}

TEST(BlackBox, NoHitWhereThereIsNoRoot) {
  struct Case {
    std::string name, source;
    std::function<double(double)> value;  // of x
    std::vector<double> roots;
  };
  const double nan = std::nan("");
  const std::vector<Case> cases{
      {"pole", source_of("1.0f / x"), [](double x) { return 1 / x; }, {}},
      {"pole elsewhere", source_of("1.0f / (x - 0.3173f)"), [](double x) { return 1 / (x - 0.3173); }, {}},
      {"steep pole", source_of("1.0f / (x * x * x)"), [](double x) { return 1 / (x * x * x); }, {}},
      {"jump", source_of("x < 0.1234f ? splat(-1.0f) : splat(1.0f)"), [](double x) { return x < 0.1234 ? -1 : 1; }, {}},
      {"jump on a slope",
       source_of("x < 0.1234f ? x - 1.5f : x + 0.5f"),
       [](double x) { return x < 0.1234 ? x - 1.5 : x + 0.5; },
       {}},
      {"root and pole", source_of("(x - 0.5f) / (x + 0.5f)"), [](double x) { return (x - 0.5) / (x + 0.5); }, {0.5}},
      {"tangents", source_of("checked_tan(3.0f * x)"), [](double x) { return std::tan(3 * x); }, {0}},
      {"undefined below 0",
       source_of("checked_sqrt(x) - 0.5f"),
       [nan](double x) { return x < 0 ? nan : std::sqrt(x) - 0.5; },
       {0.25}},
      {"cube root",
       source_of("x < 0.0f ? -checked_pow(-x, splat(0.33333333f)) : checked_pow(x, splat(0.33333333f))"),
       [](double x) { return std::cbrt(x); },
       {0}},
      {"touches from above",
       source_of("(x - 0.25f) * (x - 0.25f) + 0.0001f"),
       [](double x) { return (x - 0.25) * (x - 0.25) + 1e-4; },
       {}},
      {"zero everywhere", source_of("0.0f * x"), [](double) { return 0; }, {}},
  };
  RayBatch rays(40);
  for (std::size_t i = 0; i < rays.size(); i++)
    rays.set(i, {glm::vec3(-2 - 0.0137f * float(i), 0.3f, 0.2f), glm::vec3(1, 0, 0)});
  for (const Case& one : cases) {
    const BlackBox box{one.source, [&one](const glm::dvec3& p) { return one.value(p.x); }};
    for (TestDevice& device : one_of_each()) {
      const HitList hits = Interrogator(device.device, implicit(box, cube(1))).cast(rays, {.hits = Hits::all});
      for (std::size_t i = 0; i < rays.size(); i++) {
        const std::vector<double> t = t_of(hits, i);
        ASSERT_EQ(t.size(), one.roots.size()) << one.name << ", " << device.label << ", ray " << i;
        for (std::size_t k = 0; k < t.size(); k++)
          EXPECT_NEAR(t[k] + double(rays[i].origin.x), one.roots[k], 2e-6) << one.name << ", " << device.label;
      }
    }
  }
}

// Points of a torus, and its curvature there: 1/r of the tube, and cos v / (1 + r cos v) around.
struct TorusPoints {
  std::vector<glm::vec3> points;
  std::vector<glm::dvec3> normals;
  std::vector<double> around;
};

TorusPoints torus_points(std::size_t count) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> angle(0, 6.283185307179586);
  TorusPoints torus;
  for (std::size_t i = 0; i < count; i++) {
    const double u = angle(random), v = angle(random);
    const glm::dvec3 normal(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
    torus.points.emplace_back(glm::dvec3(std::cos(u), std::sin(u), 0) + 0.4 * normal);
    torus.normals.push_back(normal);
    torus.around.push_back(std::cos(v) / (1 + 0.4 * std::cos(v)));
  }
  return torus;
}

struct ShapeErrors {
  double normal = 0, curvature = 0;
};

ShapeErrors torus_errors(const Device& device, const TorusPoints& torus, const BlackBoxOptions& options) {
  const Shape shape_of_torus = shapes()[1];
  const PointProperties found =
      Interrogator(device, implicit(shape_of_torus.box(), cube(1.5), options)).probe(torus.points, shape);
  for (std::size_t i = 0; i < torus.points.size(); i++) {
    EXPECT_NEAR(found.mean[i], 0.5 * (found.k1[i] + found.k2[i]), 1e-6);
    EXPECT_NEAR(found.gauss[i], found.k1[i] * found.k2[i], 1e-4);
  }
  const PointErrors errors =
      compare_points(found, torus.points, torus.points.size(), [&](std::size_t i, const glm::dvec3&) {
        return PointTruth{
            .exact = {.normal = torus.normals[i], .k1 = 2.5, .k2 = torus.around[i]}, .normal = 1, .principal = 1};
      });
  EXPECT_LE(errors.of("defined"), 1);
  return {errors.of("normal"), std::max(errors.of("k1"), errors.of("k2"))};
}

TEST(BlackBox, DerivativesByDifferences) {
  const TorusPoints torus = torus_points(2000);
  for (const auto& [order, kind] :
       {std::pair{2, "black box, order 2"}, {4, "black box, order 4"}, {6, "black box, order 6"}}) {
    for (TestDevice& device : test_devices()) {
      const ShapeErrors worst = torus_errors(device.device, torus, {.difference_order = order});
      std::cout << "  order " << order << ", " << device.label << ": normal " << worst.normal << ", curvature "
                << worst.curvature << "\n";
      EXPECT_LE(worst.normal, tolerance(Quantity::normal, kind).value) << order << ", " << device.label;
      EXPECT_LE(worst.curvature, 2.5 * tolerance(Quantity::curvature, kind).value) << order << ", " << device.label;
    }
    const ShapeErrors exact = torus_errors(reference_device(), torus, {.difference_order = order});
    std::cout << "  order " << order << ", reference: normal " << exact.normal << ", curvature " << exact.curvature
              << "\n";
    EXPECT_LE(exact.normal, tolerance(Quantity::normal, black_box, Precision::float64).value) << order;
    EXPECT_LE(exact.curvature, 2.5 * tolerance(Quantity::curvature, black_box, Precision::float64).value) << order;
  }
}

// In double, where truncation shows: half the step, a 2^order-th of the error. Floats, which results are, ask for steps
// so coarse at order 6 that the next term of the error's series counts, too: worked out for the stencil around the
// hole, of radius 0.6, the ratio is 56.6 and not 64.
TEST(BlackBox, DifferencesHaveTheirOrder) {
  const TorusPoints torus = torus_points(500);
  // Coarse enough that results, which are floats, show it.
  for (const auto& [order, step] : {std::pair{2, 0.05}, {4, 0.05}, {6, 0.08}}) {
    const auto error = [&, order = order](double h) {
      return torus_errors(reference_device(), torus, {.difference_order = order, .difference_step = h}).curvature;
    };
    const double ratio = error(step) / error(step / 2);
    std::cout << "  order " << order << ": halving the step divides the error by " << ratio << "\n";
    EXPECT_NEAR(std::log2(ratio), order == 6 ? std::log2(56.6) : order, 0.1);
  }
}

TEST(BlackBox, PlacesAndStatus) {
  const Shape sphere = shapes()[0];
  const std::vector<glm::vec3> points{{0, 0, 1}, {0, 0, 0}, {9, 0, 0}, {0, 1.4999f, 0}};
  for (TestDevice& device : one_of_each()) {
    Interrogator query(device.device, sphere.surface());
    const PointProperties found = query.probe(points, shape | Property::value);
    EXPECT_EQ(found.status[0], PointStatus::umbilic) << device.label;
    EXPECT_EQ(found.status[1], PointStatus::undefined) << device.label << ": no gradient";
    EXPECT_EQ(found.status[2], PointStatus::undefined) << device.label << ": outside";
    EXPECT_EQ(found.status[3], PointStatus::umbilic) << device.label << ": the stencil reaches out of the domain";
    EXPECT_NEAR(found.mean[3], 1 / 1.4999, 1e-3) << device.label;
    EXPECT_NEAR(found.value[3], 1.4999 * 1.4999 - 1, 1e-6) << device.label;
    // The same source at another level and with other numbers.
    query.update(implicit(sphere.box(), cube(2), {.level = 1.25, .step = 0.1, .difference_step = 0.01}));
    RayBatch rays(1);
    rays.set(0, {{-9, 0, 0}, {2, 0, 0}});
    const HitList hits = query.cast(rays, {.hits = Hits::all});
    ASSERT_EQ(hits.size(), 2u) << device.label;
    EXPECT_NEAR(hits.t()[0], 3.75, 1e-6) << device.label;
    EXPECT_NEAR(hits.t()[1], 5.25, 1e-6) << device.label;
  }
}

template <class Work>
void refused(ErrorCode code, const std::string& fragment, const Work& work) {
  try {
    work();
    ADD_FAILURE() << "accepted; expected: " << fragment;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  }
}

TEST(BlackBox, TheBundledExample) {
  const Surface julia = load_surface(std::filesystem::path(SMURF_SOURCE_DIR) / "host/data/julia.json");
  const RayBatch rays = chords(1.3, 300, 5);
  std::vector<std::size_t> counts;
  for (TestDevice& device : test_devices()) {
    const Interrogator query(device.device, julia);
    const HitList hits = query.cast(rays, {.hits = Hits::all, .properties = shape | Property::value});
    const PointProperties& found = hits.properties(shape | Property::value);
    counts.push_back(hits.size());
    for (std::size_t i = 0; i < hits.size(); i++) {
      // The estimate's slope is at most about 1, and a location is rounded.
      EXPECT_NEAR(found.value[i], 0.01, 2e-5) << device.label;
      EXPECT_NEAR(glm::length(found.normal[i]), 1, 1e-5) << device.label;
    }
  }
  EXPECT_GT(counts.at(0), rays.size() / 4);
  for (const std::size_t count : counts) EXPECT_NEAR(double(count), double(counts[0]), 2);
}

TEST(BlackBox, Descriptions) {
  written("balls.inc", balls_source);
  const std::string start = R"j({"kind":"implicit","source":"balls.inc","domain":[[-2,-2,-2],[2,2,2]])j";
  const Surface surface =
      load_surface(written("balls.json", start + ",\"equation\":\"" + balls_equation +
                                             "\",\"lipschitz\":1,\"step\":0.01,\"difference_order\":6}"));
  RayBatch rays(1);
  rays.set(0, {{-9, 0, 0}, {1, 0, 0}});
  for (TestDevice& device : one_of_each()) {
    const HitList hits = Interrogator(device.device, surface).cast(rays, {.hits = Hits::all});
    ASSERT_EQ(hits.size(), 10u) << device.label;
    for (std::size_t i = 0; i < 10; i++) {
      EXPECT_NEAR(hits.t()[i], 7.8 + 0.6 * double(i / 2) + (i % 2 == 0 ? -0.25 : 0.25), 3e-6) << device.label;
      EXPECT_NEAR(hits.normals()[i].x, i % 2 == 0 ? -1 : 1, 1e-5) << device.label;
    }
  }
  const auto load = [&](const std::string& rest) {
    return [&, rest] { load_surface(written("bad.json", start + rest + "}")); };
  };
  refused(ErrorCode::input, "unknown member \"difference\"", load(R"j(,"difference":2)j"));
  refused(ErrorCode::input, "difference_order", load(R"j(,"difference_order":3)j"));
  refused(ErrorCode::input, "step along rays", load(R"j(,"step":-1)j"));
  refused(ErrorCode::input, "at least 1/65536", load(R"j(,"step":1e-9)j"));
  refused(ErrorCode::input, "bound on the gradient", load(R"j(,"lipschitz":-2)j"));
  refused(ErrorCode::input, "parameters", load(R"j(,"parameters":{"a":1})j"));
  refused(ErrorCode::input, "equation", load(R"j(,"equation":"x+")j"));
  refused(ErrorCode::input, "missing.inc", [] {
    load_surface(written("bad.json", R"j({"kind":"implicit","source":"missing.inc","domain":[[-2,-2,-2],[2,2,2]]})j"));
  });
  refused(ErrorCode::input, "\"domain\" is missing",
          [] { load_surface(written("bad.json", R"j({"kind":"implicit","source":"balls.inc"})j")); });
}

TEST(BlackBox, Refusals) {
  const auto make = [](const std::string& source) { return [source] { implicit(BlackBox{source, {}}, cube(1)); }; };
  refused(ErrorCode::input, "is empty", make(" \n"));
  refused(ErrorCode::input, "does not define the function", make("FN real other(real x) { return x; }\n"));
  refused(ErrorCode::input, "#include", make("  # include \"own.inc\"\n" + source_of("x")));
  refused(ErrorCode::input, "at most", make(source_of("x") + std::string(std::size_t(1) << 20, ' ')));
  refused(ErrorCode::input, "extent", [] { implicit(BlackBox{source_of("x"), {}}, Domain{}); });
  refused(ErrorCode::input, "finite corners", [] { implicit(BlackBox{source_of("x"), {}}, cube(-1)); });
  refused(ErrorCode::input, "level", [] { implicit(BlackBox{source_of("x"), {}}, cube(1), {.level = std::nan("")}); });
  refused(ErrorCode::usage, "no function for the host", [] {
    Interrogator(reference_device(), implicit(BlackBox{source_of("x"), {}}, cube(1)));
  });

  // What compilers find: the line, counted in the source.
  for (TestDevice& device : test_devices()) {
    const auto ask = [&](const std::string& source) {
      return [&, source] { Interrogator(device.device, implicit(BlackBox{source, {}, "mine"}, cube(1))); };
    };
    const std::string line_3 =
        "FN real black_box(real x, real y, real z) {\n  real a = x;\n  return nonsense + a;\n}\n";
    refused(ErrorCode::input, ":3:", ask(line_3));
    refused(ErrorCode::input, "nonsense", ask(line_3));
    refused(ErrorCode::input, "\"mine\" does not compile",
            ask("FN real black_box(real x, real y, real z) { return x;"));
    refused(ErrorCode::input, "black_box", ask("FN real black_box(real x, real y, real z);"));
    refused(ErrorCode::input, "black_box", ask("FN real my_black_box(real x, real y, real z) { return x; }"));
    // The device is as it was.
    RayBatch rays(1);
    rays.set(0, {{-9, 0, 0}, {1, 0, 0}});
    EXPECT_EQ(Interrogator(device.device, implicit(BlackBox{source_of("x - 0.25f"), {}}, cube(1))).cast(rays).size(),
              1u);
  }
}

}  // namespace
}  // namespace smurf::test
