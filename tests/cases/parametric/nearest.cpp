// The nearest points of surfaces s(u, v), on every device: against closed forms and the reference, and what is probed
// there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "device/executor.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/parametric_case.hpp"
#include "harness/tolerances.hpp"
#include "io/patch_file.hpp"
#include "smurf/interrogator.hpp"
#include "truth/parametric.hpp"
#include "truth/patches.hpp"

KERNELS(find_nearest, measure);

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::string_view kind = "parametric, nearest";

// Everywhere in a box about the surface, and close to it.
std::vector<glm::vec3> points_about(const RaySources& sources, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const dvec3 size = sources.box.upper - sources.box.lower;
  std::vector<glm::vec3> points;
  for (std::size_t i = 0; i < count; i++) {
    const dvec3 any(normal(random), normal(random), normal(random));
    const double a = uniform(random), b = uniform(random);
    if (i % 3 == 0) points.emplace_back(sources.box.lower + size * (1.5 * dvec3(a, b, uniform(random)) - 0.25));
    if (i % 3 == 1) points.emplace_back(sources.anywhere(a, b).position + 0.01 * glm::length(size) * any);
    if (i % 3 == 2) points.emplace_back(sources.border(a, b).position + 0.05 * glm::length(size) * any);
  }
  return points;
}

// The least distance by samples, refined about the best few: no method of the library's.
double least_distance(const RaySources& sources, const dvec3& point) {
  constexpr int count = 96, kept = 4;
  std::vector<std::pair<double, dvec2>> samples;
  for (int j = 0; j <= count; j++) {
    for (int i = 0; i <= count; i++) {
      const dvec2 at(double(i) / count, double(j) / count);
      samples.emplace_back(glm::distance(sources.anywhere(at.x, at.y).position, point), at);
    }
  }
  const auto nearer = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::ranges::nth_element(samples, samples.begin() + kept, nearer);
  double least = HUGE_VAL;
  for (int k = 0; k < kept; k++) {
    auto [distance, at] = samples[std::size_t(k)];
    // A pattern that shrinks where nothing about it is nearer.
    for (double step = 1.0 / count; step > 1e-9;) {
      bool moved = false;
      for (const dvec2 way : {dvec2(1, 0), dvec2(-1, 0), dvec2(0, 1), dvec2(0, -1), dvec2(1, 1), dvec2(-1, -1),
                              dvec2(1, -1), dvec2(-1, 1)}) {
        const dvec2 there = glm::clamp(at + step * way, 0.0, 1.0);
        const double found = glm::distance(sources.anywhere(there.x, there.y).position, point);
        if (found >= distance) continue;
        distance = found;
        at = there;
        moved = true;
      }
      if (!moved) step *= 0.5;
    }
    least = std::min(least, distance);
  }
  return least;
}

using PositionAt = std::function<dvec3(const SurfaceCoordinates&)>;

void expect_nearest(const std::string& name, const Surface& surface, const RaySources& sources,
                    const PositionAt& position, std::size_t count, std::vector<TestDevice> devices) {
  const std::vector<glm::vec3> points = points_about(sources, count, 4);
  std::vector<double> least;
  for (const glm::vec3& p : points) least.push_back(least_distance(sources, dvec3(p)));
  const double extent = extent_of(sources.box), allowed = tolerance(Quantity::place, kind).value * extent;
  devices.push_back({"reference", "reference", 0, true, reference_device()});
  for (TestDevice& device : devices) {
    const std::vector<glm::vec3> some(points.begin(),
                                      points.begin() + std::ptrdiff_t(device.slow ? points.size() / 8 : points.size()));
    const PointProperties p =
        Interrogator(device.device, surface).probe(some, std::uint32_t(Property::parameters), {.tile = 100});
    ASSERT_EQ(p.coordinates.size(), some.size()) << name << ", " << device.label;
    double worst = 0;
    std::size_t at = 0, wrong = 0;
    for (std::size_t i = 0; i < some.size(); i++) {
      const double error = glm::distance(position(p.coordinates[i]), dvec3(some[i])) - least[i];
      wrong += !(error <= allowed);
      if (error <= worst) continue;
      worst = error;
      at = i;
    }
    std::cerr << "  " << name << ", " << device.label << ": " << worst / extent << " of the extent too far\n";
    EXPECT_EQ(wrong, 0u) << name << ", " << device.label << ": of " << some.size() << " points, the worst is " << at
                         << " (" << some[at].x << ", " << some[at].y << ", " << some[at].z << "), " << worst
                         << " farther than the least distance " << least[at];
  }
}

TEST(ParametricNearest, Expressions) {
  for (const ParametricScene& scene :
       {torus_scene(2, 1), sphere_scene(1.5), cylinder_scene(1.25, 3), enneper_scene(), klein_scene()}) {
    expect_nearest(
        scene.name, scene.surface(), sources_of(scene),
        [&](const SurfaceCoordinates& at) { return scene.at(at.u, at.v).position; }, 240,
        devices_for_expressions(scene.name == "torus"));
  }
}

void expect_nearest(const std::string& name, const std::vector<Patch>& patches) {
  expect_nearest(
      name, nurbs(patches), sources_of(patches),
      [&](const SurfaceCoordinates& at) { return point_of(patches[at.part], at.u, at.v).position; }, 120,
      test_devices());
}

TEST(ParametricNearest, Patches) {
  expect_nearest("NURBS torus", {nurbs_torus(2, 1)});
  expect_nearest("NURBS sphere", {nurbs_sphere(1.5)});
  expect_nearest("folded", {folded_patch()});
}

// Points that are no numbers have no nearest point; the others what their nearest point has.
TEST(ParametricNearest, Probes) {
  const ParametricScene scene = torus_scene(2, 1);
  std::vector<glm::vec3> points = points_about(sources_of(scene), 60, 5);
  points[5] = glm::vec3(std::numeric_limits<float>::quiet_NaN(), 0, 0);
  points[6] = glm::vec3(0, std::numeric_limits<float>::infinity(), 0);
  for (TestDevice& device : test_devices()) {
    const PointProperties p = Interrogator(device.device, scene.surface())
                                  .probe(points, Property::normal | Property::mean | Property::parameters, {.tile = 7});
    for (std::size_t i = 0; i < points.size(); i++) {
      if (i == 5 || i == 6) {
        EXPECT_TRUE(p.status[i] & PointStatus::undefined) << device.label;
        EXPECT_TRUE(std::isnan(p.normal[i].x) && std::isnan(p.mean[i])) << device.label;
        continue;
      }
      const dvec3 at(points[i]);
      const double ring = std::hypot(at.x, at.y);
      // Off the axis and the ring's middle, where every point is as near.
      if (ring < 0.1 || std::hypot(ring - 2, at.z) < 0.1) continue;
      const dvec2 place = scene.place(at);
      const auto exact = differential_of(scene.at(place.x, place.y));
      EXPECT_LT(glm::distance(dvec3(p.normal[i]), exact->normal), 2e-4) << device.label << ", " << i;
      EXPECT_NEAR(p.mean[i], exact->mean, 1e-3) << device.label << ", " << i;
    }
  }
}

}  // namespace
}  // namespace smurf::test
