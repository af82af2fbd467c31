// Algebraic surfaces (truth/sturm.hpp) and the gyroid on random rays against the exact number and place of their
// roots: whatever a device says is isolated must be exactly one root, and every root must be an isolated hit or lie in
// the enclosure of one that is flagged.
//
// SMURF_TEST_DENSE=50 makes it 100,000 rays a surface.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "expression/files.hpp"
#include "expression/parser.hpp"
#include "harness/case.hpp"
#include "harness/compile_at_most.hpp"
#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/replay.hpp"
#include "harness/tolerances.hpp"
#include "numerics/parallel.hpp"
#include "smurf/interrogator.hpp"
#include "truth/rays.hpp"
#include "truth/sturm.hpp"

KERNELS(find_hits, count_blocks, order_rows);

namespace smurf::test {
namespace {

constexpr std::size_t usual_rays = 2000;
constexpr std::size_t few_rays = 100;  // on Vulkan, where it is a processor; twice as many for the reference

constexpr std::string_view kind = "implicit";

struct Scene {
  std::string name;
  std::string equation;        // or
  std::filesystem::path file;  // .jsurf
  Domain domain;
};

void PrintTo(const Scene& scene, std::ostream* out) { *out << scene.name; }

Domain box(double half) { return {glm::dvec3(-half), glm::dvec3(half), 0}; }
Domain ball(double radius) { return {glm::dvec3(-radius), glm::dvec3(radius), radius}; }

// What every checkout has.
const std::vector<Scene> own_scenes = {
    {"tanglecube", "x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", {}, box(3)},
    {"sphere", "x^2+y^2+z^2-2", {}, box(2)},
    {"torus", "(x^2+y^2+z^2+3.75)^2-16*(x^2+y^2)", {}, box(3)},
    {"monkey saddle", "x^3-3*x*y^2-z", {}, box(2)},
    {"Cayley cubic", "x^3+y^3+z^3+1-0.25*(x+y+z+1)^3", {}, ball(5)},
    {"Barth sextic",
     "4*(2.618033988749895*x^2-y^2)*(2.618033988749895*y^2-z^2)*(2.618033988749895*z^2-x^2)"
     "-4.23606797749979*(x^2+y^2+z^2-1)^2",
     {},
     ball(2)},
    {"eighth degree", "x^8+y^8+z^8-2*(x^6+y^6+z^6)+1.25*(x^4+y^4+z^4)-0.25*(x^2+y^2+z^2)+0.0325", {}, box(1.25)},
    {"seventh degree", "(x^2+y^2+z^2-1)^3*(x-0.3)+0.2*x*y*z-0.05", {}, box(1.5)},
};

const char* const collection = "implicit/jsurf";

// jsurf's collection, where the development data is at hand; in the domain that such files have unless told otherwise.
std::vector<Scene> collected_scenes() {
  std::vector<Scene> scenes;
  if (std::filesystem::is_directory(shared_data(collection))) {
    for (const auto& entry : std::filesystem::directory_iterator(shared_data(collection))) {
      if (entry.path().extension() == ".jsurf")
        scenes.push_back({entry.path().stem().string(), {}, std::filesystem::canonical(entry.path()), ball(5)});
    }
  }
  std::ranges::sort(scenes, {}, &Scene::name);
  return scenes;
}

Surface surface_of(const Scene& scene) {
  return scene.file.empty() ? implicit(scene.equation, scene.domain) : load_implicit(scene.file);
}

AlgebraicSurface algebraic_surface_of(const Scene& scene) {
  if (!scene.file.empty()) {
    const expression::ImplicitFile file = expression::load_jsurf(scene.file);
    return AlgebraicSurface(file.graph, file.root);
  }
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  return AlgebraicSurface(graph, expression::parse(graph, scene.equation, variables, {}));
}

// What is known of a surface by other means than the library's.
struct Exact {
  std::string kind;
  std::function<DistinctRoots(const Ray&, const RayPart&)> roots;
};

Exact exact_of(const Scene& scene) {
  const AlgebraicSurface surface = algebraic_surface_of(scene);
  return {fmt::format("degree {}", surface.degree()),
          [surface](const Ray& ray, const RayPart& part) { return surface.roots(ray, part); }};
}

// The gyroid sin x cos y + sin y cos z + sin z cos x is a sum of six sines along a ray, sin x cos y = (sin(x + y) +
// sin(x - y))/2. The sizes of its second derivative's terms bound how far it departs from its tangent: stretches are
// halved until they are proved to have no root, or a slope of one sign. In long double, of which a margin of 1e-15 is
// thousands of roundings.
class GyroidOnRay {
 public:
  explicit GyroidOnRay(const Ray& ray) {
    for (int axis = 0; axis < 3; axis++) {
      const int other = (axis + 1) % 3;
      for (const int sign : {1, -1}) {
        waves_[count_++] = {Real(ray.origin[axis]) + sign * Real(ray.origin[other]),
                            Real(ray.direction[axis]) + sign * Real(ray.direction[other])};
      }
    }
    for (const Wave& wave : waves_) bend_ += 0.5L * wave.rate * wave.rate;
  }

  DistinctRoots roots(const RayPart& part) {
    found_ = {};
    if (part.first < part.last) search(part.first, part.last);
    return found_;
  }

 private:
  using Real = long double;
  static constexpr Real margin = 1e-15L, least = 1e-10L;
  struct Wave {
    Real phase, rate;
  };

  Real value(Real t) const {
    Real sum = 0;
    for (const Wave& wave : waves_) sum += std::sin(wave.phase + wave.rate * t);
    return sum / 2;
  }
  Real slope(Real t) const {
    Real sum = 0;
    for (const Wave& wave : waves_) sum += wave.rate * std::cos(wave.phase + wave.rate * t);
    return sum / 2;
  }

  void search(Real low, Real high) {
    const Real middle = (low + high) / 2, half = (high - low) / 2;
    const Real steep = std::abs(slope(middle));
    if (std::abs(value(middle)) > steep * half + bend_ * half * half / 2 + margin) return;
    if (steep > bend_ * half + margin) {
      const Real first = value(low), last = value(high);
      found_.doubtful = found_.doubtful || std::abs(first) < margin || std::abs(last) < margin;
      if ((first < 0) != (last < 0)) found_.at.push_back(double(between(low, high, first < 0)));
    } else if (half < least) {
      found_.doubtful = true;
    } else {
      search(low, middle);
      search(middle, high);
    }
  }
  Real between(Real low, Real high, bool rising) const {
    for (int i = 0; i < 60; i++) {
      const Real middle = (low + high) / 2;
      ((value(middle) < 0) == rising ? low : high) = middle;
    }
    return low;
  }

  std::array<Wave, 6> waves_{};
  std::size_t count_ = 0;
  Real bend_ = 0;
  DistinctRoots found_;
};

// A case without its rays.
Case case_of(const Scene& scene) {
  const Domain& d = scene.domain;
  const std::string what =
      scene.file.empty() ? "\"equation\":\"" + scene.equation + "\"" : "\"file\":\"" + scene.file.string() + "\"";
  const std::string radius = d.radius > 0 ? fmt::format(",\"radius\":{}", d.radius) : "";
  const std::string json = fmt::format("{{\"kind\":\"implicit\",{},\"domain\":[[{},{},{}],[{},{},{}]]{}}}\n", what,
                                       d.lower.x, d.lower.y, d.lower.z, d.upper.x, d.upper.y, d.upper.z, radius);
  return {.name = scene.name,
          .surface = surface_of(scene),
          .replay = [json](const std::string& name, const Ray& ray, const std::string& device) {
            return replay_command(name + " " + device, json, ray, device);
          }};
}

// Lines through two random points, from outside: of the whole domain, and every second time of its middle, where most
// of these surfaces are.
RayBatch chords(const Domain& domain, std::size_t count, unsigned seed) {
  BoxChords chords = chords_of(domain.lower, domain.upper);
  chords.radius = domain.radius;
  chords.inner = 0.3;
  return random_chords(chords, count, seed);
}

// The exact answer for one ray: all roots up to a margin beyond the domain, and the part in which every one of them
// must be found.
class ExactRay : public RayOracle {
 public:
  ExactRay(const Exact& exact, const Domain& domain, const Ray& ray) {
    const double margin = tolerance(Quantity::border, kind).value * glm::length(domain.upper - domain.lower);
    whole_ = part_of(domain, ray, margin);
    inner_ = part_of(domain, ray, -margin);
    const DistinctRoots found = exact.roots(ray, whole_);
    doubtful_ = found.doubtful;
    for (const double t : found.at) known.push_back({t, inner_.contains(t)});
    rounding_ = tolerance(Quantity::t, kind).value * 0x1p-24 * std::max(std::abs(whole_.first), std::abs(whole_.last));
  }

  std::vector<Root> known;

  std::span<const Root> roots() const override { return known; }
  bool doubtful() const override { return doubtful_; }
  Match match(const Hit& hit, const Root& root) const override {
    const double off = std::abs(root.t - hit.t) / enclosure(hit);
    return off <= 1 ? Match{off, off} : Match{};
  }
  double enclosure(const Hit& hit) const override { return hit.uncertainty + rounding_; }
  double length() const override { return whole_.last - whole_.first; }

 private:
  RayPart whole_{0, 0}, inner_{0, 0};
  double rounding_ = 0;
  bool doubtful_ = false;
};

class ExactOracle : public Oracle {
 public:
  ExactOracle(const Exact& exact, const Domain& domain, const RayBatch& rays) : of_rays_(rays.size()) {
    parallel_for(rays.size(), [&](std::size_t i) { of_rays_[i].emplace(exact, domain, rays[i]); });
  }

  std::unique_ptr<const RayOracle> on(std::size_t index, const Ray&) const override {
    return std::make_unique<ExactRay>(*of_rays_[index]);
  }

 private:
  std::vector<std::optional<ExactRay>> of_rays_;
};

void check(const Scene& scene, const Exact& exact, const TestDevice& device, const RayBatch& rays) {
  const Case one = case_of(scene);
  const HitList hits = Interrogator(device.device, one.surface).cast(rays, {.hits = Hits::all});
  ASSERT_EQ(hits.ray_count(), rays.size());
  const ExactOracle oracle(exact, scene.domain, rays);
  const Verdict verdict = expect_hits(one, "chords", rays, oracle, device, hits);
  const std::string label = scene.name + ", " + device.label;
  std::cout << "  " << label << ": " << exact.kind << ", " << verdict.summary() << "\n";
  EXPECT_EQ(verdict.failures(), 0u) << label;
  // Whoever counts must know.
  EXPECT_LE(verdict.doubtful_rays, rays.size() / 10000) << label;
  EXPECT_GT(verdict.roots, rays.size() / 50) << label << ": the rays show nothing";
  // The reference decides by itself: of its few rays one may come near to where sheets cross.
  constexpr double most_flagged = tolerance(Quantity::flagged_rays, kind).value;
  EXPECT_LE(double(verdict.flagged_rays), most_flagged * double(rays.size()) + (device.name == "reference" ? 1 : 0))
      << label;
}

std::size_t rays_of(std::size_t usual) { return usual * std::size_t(density()); }

void run(const Scene& scene, const Exact& exact, const TestDevice& device, std::size_t count) {
  check(scene, exact, device, chords(scene.domain, count, 41));
}

TestDevice reference() { return {"reference", "reference", 0, false, reference_device()}; }

void run_on(const char* executor, const Scene& scene, const Exact& exact, std::size_t count) {
  // A device that is missing is reported where devices are opened.
  if (const TestDevice* device = test_device(executor)) run(scene, exact, *device, count);
}

class AlgebraicRoots : public testing::TestWithParam<Scene> {};
class AlgebraicRootsOnVulkan : public AlgebraicRoots {};

// Compiling one surface after the other takes minutes, so most of the collection is interpreted, by programs that they
// share: all but those with the highest degrees and the worst singularities. The dense run compiles all.
bool is_compiled(const Scene& scene) {
  constexpr std::array<std::string_view, 5> hardest = {"fantasy_quaste", "fantasy_suess", "record_7eck",
                                                       "record_chmutovoktic", "tutorial_parabel"};
  return std::ranges::find(own_scenes, scene.name, &Scene::name) != std::end(own_scenes) ||
         std::ranges::find(hardest, scene.name) != hardest.end() || rays_of(1) > 1;
}

TEST_P(AlgebraicRoots, OpenCl) {
  const CompileAtMost operations(is_compiled(GetParam()) ? "400" : "0");
  run_on("opencl", GetParam(), exact_of(GetParam()), rays_of(usual_rays));
}
TEST_P(AlgebraicRoots, Reference) { run(GetParam(), exact_of(GetParam()), reference(), 2 * few_rays); }
TEST_P(AlgebraicRootsOnVulkan, Vulkan) { run_on("vulkan", GetParam(), exact_of(GetParam()), few_rays); }

TEST(GyroidRoots, OnEachDevice) {
  const Scene scene{"gyroid", "sin(x)*cos(y)+sin(y)*cos(z)+sin(z)*cos(x)", {}, box(4)};
  const Exact exact{"sines", [](const Ray& ray, const RayPart& part) { return GyroidOnRay(ray).roots(part); }};
  run_on("opencl", scene, exact, rays_of(usual_rays));
  run(scene, exact, reference(), 2 * few_rays);
  run_on("vulkan", scene, exact, few_rays);
}

std::string name_of_test(const testing::TestParamInfo<Scene>& info) {
  std::string name = info.param.name;
  std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
  return name;
}

INSTANTIATE_TEST_SUITE_P(Own, AlgebraicRoots, testing::ValuesIn(own_scenes), name_of_test);
INSTANTIATE_TEST_SUITE_P(Collected, AlgebraicRoots, testing::ValuesIn(collected_scenes()), name_of_test);
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(AlgebraicRoots);
INSTANTIATE_TEST_SUITE_P(Own, AlgebraicRootsOnVulkan, testing::ValuesIn(own_scenes), name_of_test);

// The judge itself: right hits are found wrong as soon as the truth is another one.
TEST(ExactRootsVerdict, NoticesWhatIsWrong) {
  const Scene& scene = own_scenes.front();
  const Exact exact = exact_of(scene);
  const RayBatch rays = chords(scene.domain, 100, 7);
  const HitList hits = Interrogator(reference_device(), surface_of(scene)).cast(rays, {.hits = Hits::all});
  std::size_t tried = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const auto wrong = [&](const ExactRay& oracle) {
      const Verdict verdict = judge_ray(hits, i, oracle, rays[i]);
      EXPECT_EQ(verdict.failures(), verdict.missed + verdict.invented) << "ray " << i << ": " << verdict.worst;
      return std::pair(verdict.missed, verdict.invented);
    };
    const auto pair = [](std::size_t missed, std::size_t invented) { return std::pair(missed, invented); };
    const ExactRay truth(exact, scene.domain, rays[i]);
    ASSERT_EQ(wrong(truth), pair(0, 0)) << "ray " << i;
    if (truth.known.size() < 2) continue;
    tried++;
    ExactRay fewer = truth, more = truth, moved = truth;
    fewer.known.erase(fewer.known.begin());
    EXPECT_EQ(wrong(fewer), pair(0, 1)) << "ray " << i;
    more.known.insert(more.known.begin() + 1, {0.5 * (more.known[0].t + more.known[1].t)});
    EXPECT_EQ(wrong(more), pair(1, 0)) << "ray " << i;
    moved.known.front().t -= 1e-4;
    EXPECT_EQ(wrong(moved), pair(1, 1)) << "ray " << i;
  }
  EXPECT_GT(tried, 20u);
}

TEST(AlgebraicCollection, IsComplete) {
  if (!has_shared_data(collection)) GTEST_SKIP() << "the scenes of our own stand for it";
  EXPECT_EQ(collected_scenes().size(), 36u);
}

}  // namespace
}  // namespace smurf::test
