// Algebraic surfaces (harness/sturm.hpp) and the gyroid on random rays against the exact number and place of their
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
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "expression/files.hpp"
#include "expression/parser.hpp"
#include "harness/compile_at_most.hpp"
#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/replay.hpp"
#include "harness/shared_data.hpp"
#include "numerics/parallel.hpp"
#include "smurf/interrogator.hpp"
#include "truth/sturm.hpp"

KERNELS(find_hits, count_blocks, order_rows);

namespace smurf::test {
namespace {

constexpr std::size_t usual_rays = 2000;
constexpr std::size_t few_rays = 100;  // on Vulkan, where it is a processor; twice as many for the reference

// t is a float, and the sum of two: where the ray enters the domain, and how far the hit is from there. Each rounds to
// half a unit of its last place, 2^-24 of the farthest t.
constexpr double rounding_of_t = 2 * 0x1p-24;
// Roots this close to the border of the domain, in parts of its size, may be found or not: devices clip in floats, from
// where the ray begins, which is one and a half such sizes away.
constexpr double border = 2e-6;

// Rays that may be flagged. Hits that are flagged by floats are decided in double (host/api/resolve_hits.hpp), which
// leaves those at which rounding in double matters: double roots, and singular points nearer than about 1e-6. Random
// rays meet neither, not even on surfaces that are singular along whole curves; so it is all flagged rays that count,
// wherever they are.
constexpr double most_flagged = 1e-3;

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

std::string replay(const Scene& scene, std::size_t index, const Ray& ray, const TestDevice& device) {
  const Domain& d = scene.domain;
  const std::string what =
      scene.file.empty() ? "\"equation\":\"" + scene.equation + "\"" : "\"file\":\"" + scene.file.string() + "\"";
  const std::string radius = d.radius > 0 ? fmt::format(",\"radius\":{}", d.radius) : "";
  const std::string json = fmt::format("{{\"kind\":\"implicit\",{},\"domain\":[[{},{},{}],[{},{},{}]]{}}}\n", what,
                                       d.lower.x, d.lower.y, d.lower.z, d.upper.x, d.upper.y, d.upper.z, radius);
  return replay_command(fmt::format("{} {} {}", scene.name, device.name, index), json, ray, device.name);
}

// Lines through two random points, from outside: of the whole domain, and every second time of its middle, where most
// of these surfaces are.
RayBatch chords(const Domain& domain, std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto point = [&](double part) {
    while (true) {
      const glm::dvec3 u(unit(random), unit(random), unit(random));
      const glm::dvec3 p = domain.lower + (domain.upper - domain.lower) * u;
      if (domain.radius == 0 || glm::length(p) <= domain.radius) return part * p;
    }
  };
  const double size = glm::length(domain.upper - domain.lower);
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const double part = i % 2 == 0 ? 1 : 0.3;
    const glm::dvec3 a = point(part), b = point(part);
    const glm::dvec3 along = glm::normalize(b - a);
    rays.set(i, {glm::vec3(a - 1.5 * size * along), glm::vec3((0.25 + unit(random)) * along)});
  }
  return rays;
}

// The exact answer for one ray: all roots up to a margin beyond the domain, and the part in which every one of them
// must be found.
struct Truth {
  DistinctRoots roots;
  RayPart whole{0, 0}, inner{0, 0};
};

std::vector<Truth> truth_of(const Exact& exact, const Domain& domain, const RayBatch& rays) {
  const double margin = border * glm::length(domain.upper - domain.lower);
  std::vector<Truth> truth(rays.size());
  parallel_for(rays.size(), [&](std::size_t i) {
    truth[i].whole = part_of(domain, rays[i], margin);
    truth[i].inner = part_of(domain, rays[i], -margin);
    truth[i].roots = exact.roots(rays[i], truth[i].whole);
  });
  return truth;
}

struct Verdict {
  std::size_t roots = 0, missed = 0, invented = 0;
  bool flagged = false;
  double worst = 0;   // distance of an isolated hit from its root, of what is allowed
  double widest = 0;  // flagged enclosure, of the ray's part
};

Verdict judge(const HitList& hits, std::size_t ray_index, const Truth& truth) {
  Verdict verdict;
  const double rounding = rounding_of_t * std::max(std::abs(truth.whole.first), std::abs(truth.whole.last));
  const std::vector<double>& roots = truth.roots.at;
  verdict.roots = roots.size();
  std::vector<bool> found(roots.size());
  const std::size_t begin = hits.offsets()[ray_index], end = hits.offsets()[ray_index + 1];
  std::size_t next = 0;
  for (std::size_t h = begin; h < end; h++) {
    const double t = hits.t()[h], reach = hits.uncertainty()[h] + rounding;
    if (hits.status()[h] == HitStatus::isolated) {
      // Both are in order: a root that was passed over is not for a later hit.
      while (next < roots.size() && roots[next] < t - reach) next++;
      if (next < roots.size() && roots[next] <= t + reach) {
        verdict.worst = std::max(verdict.worst, std::abs(roots[next] - t) / reach);
        found[next++] = true;
      } else {
        verdict.invented++;
      }
      continue;
    }
    verdict.flagged = true;
    const double length = truth.whole.last - truth.whole.first;
    verdict.widest = std::max(verdict.widest, 2 * double(hits.uncertainty()[h]) / length);
  }
  for (std::size_t r = 0; r < roots.size(); r++) {
    if (found[r] || !truth.inner.contains(roots[r])) continue;
    bool enclosed = false;
    for (std::size_t h = begin; h < end && !enclosed; h++) {
      enclosed = hits.status()[h] != HitStatus::isolated &&
                 std::abs(hits.t()[h] - roots[r]) <= hits.uncertainty()[h] + rounding;
    }
    verdict.missed += !enclosed;
  }
  return verdict;
}

std::string told(const HitList& hits, std::size_t ray, const Truth& truth) {
  std::string text = "roots";
  for (const double t : truth.roots.at) text += fmt::format(" {:.9g}", t);
  text += "; hits";
  for (std::size_t h = hits.offsets()[ray]; h < hits.offsets()[ray + 1]; h++)
    text += fmt::format(" {:.9g}±{:.2g} {}", hits.t()[h], hits.uncertainty()[h], name_of(hits.status()[h]));
  return text;
}

void check(const Scene& scene, const Exact& exact, const TestDevice& device, const RayBatch& rays,
           const std::vector<Truth>& truth) {
  const HitList hits = Interrogator(device.device, surface_of(scene)).cast(rays, {.hits = Hits::all});
  ASSERT_EQ(hits.ray_count(), rays.size());
  std::vector<Verdict> verdicts(rays.size());
  parallel_for(rays.size(), [&](std::size_t i) { verdicts[i] = judge(hits, i, truth[i]); });
  std::size_t roots = 0, flagged = 0, doubtful = 0, wrong = 0;
  double worst = 0, widest = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const Verdict& verdict = verdicts[i];
    roots += verdict.roots;
    flagged += verdict.flagged;
    widest = std::max(widest, verdict.widest);
    doubtful += truth[i].roots.doubtful;
    if (truth[i].roots.doubtful) continue;
    worst = std::max(worst, verdict.worst);
    if (verdict.missed + verdict.invented == 0) continue;
    if (wrong++ < 3) {
      ADD_FAILURE() << scene.name << ", " << device.label << ", ray " << i << ": " << verdict.missed << " missed, "
                    << verdict.invented << " invented; " << told(hits, i, truth[i]) << "\n  "
                    << replay(scene, i, rays[i], device);
    }
  }
  const std::string label = scene.name + ", " + device.label;
  std::cout << fmt::format(
      "  {}: {}, {} rays, {} roots, {} flagged, {} wrong, {} doubtful; "
      "t off by {:.2f} of what is allowed, widest enclosure {:.2g} of the ray\n",
      label, exact.kind, rays.size(), roots, flagged, wrong, doubtful, worst, widest);
  EXPECT_EQ(wrong, 0u) << label;
  // Whoever counts must know.
  EXPECT_LE(doubtful, rays.size() / 10000) << label;
  EXPECT_GT(roots, rays.size() / 50) << label << ": the rays show nothing";
  // The reference decides by itself: of its few rays one may come near to where sheets cross.
  EXPECT_LE(double(flagged), most_flagged * double(rays.size()) + (device.name == "reference" ? 1 : 0)) << label;
}

std::size_t rays_of(std::size_t usual) { return usual * std::size_t(density()); }

void run(const Scene& scene, const Exact& exact, const TestDevice& device, std::size_t count) {
  const RayBatch rays = chords(scene.domain, count, 41);
  check(scene, exact, device, rays, truth_of(exact, scene.domain, rays));
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

// The verdict itself: right hits are found wrong as soon as the truth is another one.
TEST(ExactRootsVerdict, NoticesWhatIsWrong) {
  const Scene& scene = own_scenes.front();
  const Exact exact = exact_of(scene);
  const RayBatch rays = chords(scene.domain, 100, 7);
  const std::vector<Truth> truth = truth_of(exact, scene.domain, rays);
  const HitList hits = Interrogator(reference_device(), surface_of(scene)).cast(rays, {.hits = Hits::all});
  std::size_t tried = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const auto wrong = [&](const Truth& other) {
      const Verdict verdict = judge(hits, i, other);
      return std::pair(verdict.missed, verdict.invented);
    };
    const auto pair = [](std::size_t missed, std::size_t invented) { return std::pair(missed, invented); };
    ASSERT_EQ(wrong(truth[i]), pair(0, 0)) << "ray " << i;
    if (truth[i].roots.at.size() < 2) continue;
    tried++;
    Truth fewer = truth[i], more = truth[i], moved = truth[i];
    fewer.roots.at.erase(fewer.roots.at.begin());
    EXPECT_EQ(wrong(fewer), pair(0, 1)) << "ray " << i;
    more.roots.at.insert(more.roots.at.begin() + 1, 0.5 * (more.roots.at[0] + more.roots.at[1]));
    EXPECT_EQ(wrong(more), pair(1, 0)) << "ray " << i;
    moved.roots.at.front() -= 1e-4;
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
