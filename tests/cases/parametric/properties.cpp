// Normals, curvature and principal directions of surfaces s(u, v), on every device: against derivatives that come from
// no text of the library's, and against what is known in closed form (Enneper is minimal, the pseudosphere has K = -1,
// curvature adds up to 2π·χ); and what is told at poles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/parametric_case.hpp"
#include "harness/tolerances.hpp"
#include "io/patch_file.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/surface_definition.hpp"
#include "truth/parametric.hpp"
#include "truth/patches.hpp"

KERNELS(find_hits, measure);

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::string_view kind = "parametric";
constexpr double pi = std::numbers::pi;
constexpr std::uint32_t all =
    Property::normal | Property::gauss | Property::mean | Property::principal | Property::directions;

std::vector<TestDevice> with_reference(std::vector<TestDevice> devices) {
  devices.push_back({"reference", "reference", 0, true, reference_device()});
  return devices;
}

// Places all over the range, at its borders and seams as well; and what is told there.
struct Places {
  std::vector<SurfaceCoordinates> at;
  std::vector<glm::vec3> locations;

  void add(const SurfaceCoordinates& place, const dvec3& location) {
    at.push_back(place);
    locations.emplace_back(location);
  }
  Places first(std::size_t count) const {
    count = std::min(count, at.size());
    const auto end = std::ptrdiff_t(count);
    return {{at.begin(), at.begin() + end}, {locations.begin(), locations.begin() + end}};
  }
};

Places places_on(const ParametricScene& scene, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Places places;
  for (int tried = 0; places.at.size() < count; tried++) {
    dvec2 part(uniform(random), uniform(random));
    if (tried % 8 == 0) part[tried / 8 % 2] = tried / 16 % 2;
    const dvec2 at = scene.lower + (scene.upper - scene.lower) * part;
    const SurfaceCoordinates place{0, float(at.x), float(at.y)};
    const PatchPoint p = scene.at(place.u, place.v);
    // Next to poles u has no meaning to floats, and x_u no digits.
    if (glm::length(p.u) < 0.01 * glm::length(p.v) || glm::length(p.v) < 0.01 * glm::length(p.u)) continue;
    places.add(place, p.position);
  }
  return places;
}

Places places_on(const std::vector<Patch>& patches, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Places places;
  while (places.at.size() < count) {
    const auto part = std::uint32_t(places.at.size() % patches.size());
    const Patch& p = patches[part];
    const SurfaceCoordinates place{part, float(p.lower(0) + uniform(random) * (p.upper(0) - p.lower(0))),
                                   float(p.lower(1) + uniform(random) * (p.upper(1) - p.lower(1)))};
    const PatchPoint at = point_of(p, place.u, place.v);
    const double u = glm::length(at.u), v = glm::length(at.v);
    if (std::min(u, v) < 0.02 * std::max(u, v)) {
      if (uniform(random) < 0.01) return places;  // a patch that is so everywhere
      continue;
    }
    places.add(place, at.position);
  }
  return places;
}

PointProperties measured_on(const TestDevice& device, const Surface& surface, const Places& places) {
  PointProperties out;
  const auto query = device.device.is_reference() ? interrogate_by_reference(surface.model())
                                                  : interrogate_on_device(device.device, surface.share());
  query->measure({places.locations, places.at, {}}, all, {}, out);
  return out;
}

void expect_properties(const std::string& name, const Surface& surface, const Places& places, double extent,
                       const PointAt& at, const std::vector<TestDevice>& devices) {
  for (const TestDevice& device : with_reference(devices)) {
    const Places some = places.first(device.slow ? 200 : places.at.size());
    const PointProperties found = measured_on(device, surface, some);
    const PointErrors errors =
        compare_points(found, some.locations, some.at.size(), parametric_points(some.at, extent, at));
    std::cerr << "  " << name << ", " << device.label << ": error / tolerance:" << errors.summary() << "\n";
    EXPECT_GT(errors.compared, some.at.size() / 2) << name;
    expect_points(errors, some.locations, name + ", " + device.label);
  }
}

TEST(ParametricProperties, Expressions) {
  std::vector<ParametricScene> scenes = algebraic_scenes();
  for (ParametricScene& scene : other_scenes()) scenes.push_back(std::move(scene));
  for (const ParametricScene& scene : scenes) {
    expect_properties(
        scene.name, scene.surface(), places_on(scene, 2000 * std::size_t(density()), 5),
        extent_of(sampled_bounds(scene)), [&](const SurfaceCoordinates& at) { return scene.at(at.u, at.v); },
        devices_for_expressions(scene.name == "torus"));
  }
}

TEST(ParametricProperties, Patches) {
  std::vector<std::pair<std::string, std::vector<Patch>>> models{{"NURBS torus", {nurbs_torus(2, 1)}},
                                                                 {"torus of half circles", torus_of_half_circles(2, 1)},
                                                                 {"NURBS sphere", {nurbs_sphere(1.5)}},
                                                                 {"NURBS cylinder", {nurbs_cylinder(1, 3)}},
                                                                 {"quilt", quilt(3)},
                                                                 {"folded", {folded_patch()}}};
  if (has_shared_data("patches/teapot.bpt")) {
    models.emplace_back("teapot", load_patches(shared_data("patches/teapot.bpt")));
    models.emplace_back("egg", load_patches(shared_data("patches/gismo/egg.json")));
  }
  for (const auto& [name, patches] : models) {
    expect_properties(
        name, nurbs(patches), places_on(patches, 2000 * std::size_t(density()), 6), extent_of(patches),
        [&](const SurfaceCoordinates& at) { return point_of(patches[at.part], at.u, at.v); }, test_devices());
  }
}

// What hits tell is what their places have.
TEST(ParametricProperties, OfHits) {
  for (const ParametricScene& scene : {torus_scene(2, 1), enneper_scene()}) {
    const double extent = extent_of(sampled_bounds(scene));
    const RayFamily chords = parametric_families(scene, 1000, 1, 3)[0];
    for (const TestDevice& device : devices_for_expressions()) {
      const RayBatch rays = device.slow ? first_rays(chords.rays, 100) : chords.rays;
      const HitList hits =
          Interrogator(device.device, scene.surface()).cast(rays, {.hits = Hits::all, .properties = all});
      ASSERT_GT(hits.size(), rays.size() / 8);
      std::vector<glm::vec3> directions(hits.size(), glm::vec3(0.3f, -0.5f, 0.8f));
      const auto along = hits.normal_curvatures(directions);
      const PointErrors errors =
          compare_points(hits.properties(all), hits.locations(), hits.size(),
                         parametric_points(hits.coordinates(), extent,
                                           [&](const SurfaceCoordinates& at) { return scene.at(at.u, at.v); }),
                         directions, std::span<const float>(along));
      expect_points(errors, hits.locations(), scene.name + ", " + device.label);
      // The place is the one that u and v name.
      double worst = 0;
      for (std::size_t i = 0; i < hits.size(); i++) {
        const SurfaceCoordinates at = hits.coordinates()[i];
        worst = std::max(worst, glm::distance(scene.at(at.u, at.v).position, dvec3(hits.locations()[i])) / extent);
      }
      EXPECT_LT(worst, 4 * tolerance(Quantity::place, kind).value) << scene.name << ", " << device.label;
    }
  }
}

// ---- Closed forms

TEST(ParametricProperties, EnneperIsMinimal) {
  const ParametricScene scene = enneper_scene();
  const Places places = places_on(scene, 1000, 7);
  for (const TestDevice& device : with_reference(devices_for_expressions())) {
    const Places some = places.first(device.slow ? 100 : 1000);
    const PointProperties p = measured_on(device, scene.surface(), some);
    for (std::size_t i = 0; i < some.at.size(); i++) {
      const double u = some.at[i].u, v = some.at[i].v, k = 2 / std::pow(1 + u * u + v * v, 2);
      ASSERT_NEAR(p.mean[i] / k, 0, 1e-4) << device.label << ", " << u << ", " << v;
      ASSERT_NEAR(p.k1[i] / k, 1, 1e-4) << device.label << ", " << u << ", " << v;
      ASSERT_NEAR(p.gauss[i] / (k * k), -1, 2e-4) << device.label << ", " << u << ", " << v;
    }
  }
}

// K = -1; the principal curvatures are sinh u and its inverse, of which the lesser is right to 1e-4 of the greater.
TEST(ParametricProperties, PseudosphereHasGaussCurvatureMinusOne) {
  const ParametricScene scene = pseudosphere_scene();
  const Places places = places_on(scene, 1000, 8);
  for (const TestDevice& device : with_reference(devices_for_expressions())) {
    const Places some = places.first(device.slow ? 100 : 1000);
    const PointProperties p = measured_on(device, scene.surface(), some);
    for (std::size_t i = 0; i < some.at.size(); i++) {
      const double k = std::sinh(some.at[i].u), greater = std::max(k, 1 / k);
      ASSERT_NEAR(p.gauss[i], -1, 1e-4 * greater * greater) << device.label << ", u = " << some.at[i].u;
    }
  }
}

// ∫K dA by Gauss's quadrature of eight points a piece and direction; area elements in double.
double total_curvature(const TestDevice& device, const Patch& patch) {
  constexpr std::array nodes{0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  constexpr std::array weights{0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  Places places;
  std::vector<double> areas;
  const auto spans = [&](int axis) {
    std::vector<double> knots = patch.knots[std::size_t(axis)];
    const auto end = std::ranges::unique(knots);
    knots.erase(end.begin(), end.end());
    return knots;
  };
  const auto each = [&](const std::vector<double>& knots, const std::function<void(double, double)>& visit) {
    for (std::size_t k = 0; k + 1 < knots.size(); k++) {
      const double middle = 0.5 * (knots[k] + knots[k + 1]), half = 0.5 * (knots[k + 1] - knots[k]);
      for (std::size_t i = 0; i < nodes.size(); i++) {
        for (const double sign : {-1.0, 1.0}) visit(middle + sign * half * nodes[i], half * weights[i]);
      }
    }
  };
  each(spans(0), [&](double u, double weight_u) {
    each(spans(1), [&](double v, double weight_v) {
      const PatchPoint p = point_of(patch, u, v);
      places.add({0, float(u), float(v)}, p.position);
      areas.push_back(weight_u * weight_v * glm::length(glm::cross(p.u, p.v)));
    });
  });
  const PointProperties p = measured_on(device, nurbs({patch}), places);
  double sum = 0;
  for (std::size_t i = 0; i < areas.size(); i++) sum += double(p.gauss[i]) * areas[i];
  return sum;
}

TEST(ParametricProperties, GaussBonnet) {
  for (const TestDevice& device : with_reference(test_devices())) {
    EXPECT_NEAR(total_curvature(device, nurbs_torus(2, 1)), 0, 1e-3) << device.label;
    EXPECT_NEAR(total_curvature(device, nurbs_sphere(1.5)), 4 * pi, 1e-3) << device.label;
  }
}

// ---- Poles

// At a pole that is smooth the limits are told, and that it is one; at the tip of a cone there are none.
TEST(ParametricProperties, Poles) {
  ParametricScene cone;
  cone.position = {"v*cos(u)", "v*sin(u)", "v"};
  cone.upper = {2 * pi, 1};
  const std::vector<Ray> list{{{0, 0, 5}, {0, 0, -1}}};
  const RayBatch rays{std::span<const Ray>(list)};
  for (const TestDevice& device : with_reference(devices_for_expressions())) {
    for (const bool of_patches : {false, true}) {
      const Surface sphere = of_patches ? nurbs({nurbs_sphere(1.5)}) : sphere_scene(1.5).surface();
      const HitList hits = Interrogator(device.device, sphere).cast(rays, {.hits = Hits::all, .properties = all});
      const std::string where = device.label + (of_patches ? ", patches" : ", expressions");
      ASSERT_EQ(hits.size(), 2u) << where;
      for (std::size_t i = 0; i < 2; i++) {
        EXPECT_NEAR(hits.t()[i], i == 0 ? 3.5 : 6.5, 1e-5) << where;
        EXPECT_TRUE(hits.point_status()[i] & PointStatus::singular) << where;
        EXPECT_EQ(hits.point_status()[i] & PointStatus::undefined, 0u) << where;
        EXPECT_NEAR(hits.normals()[i].z, i == 0 ? 1 : -1, 1e-5) << where;
        EXPECT_NEAR(hits.mean_curvatures()[i], 1 / 1.5, 1e-4) << where;
        EXPECT_NEAR(hits.gauss_curvatures()[i], 1 / 2.25, 1e-4) << where;
        EXPECT_EQ(hits.coordinates()[i].u, 0) << where << ": the coordinate that is free starts its range";
      }
    }
    const HitList hits = Interrogator(device.device, cone.surface()).cast(rays, {.hits = Hits::all, .properties = all});
    ASSERT_GE(hits.size(), 1u) << device.label << ", cone";
    EXPECT_TRUE(hits.point_status()[0] & PointStatus::singular) << device.label << ", cone";
    EXPECT_TRUE(hits.point_status()[0] & PointStatus::undefined) << device.label << ", cone";
    EXPECT_TRUE(std::isnan(hits.normals()[0].x)) << device.label << ", cone";
  }
}

}  // namespace
}  // namespace smurf::test
