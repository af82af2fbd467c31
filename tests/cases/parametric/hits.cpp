// Rays against surfaces s(u, v) that are given by expressions, on every device: counts, t and (u, v) equal to closed
// forms (sphere, ellipsoid, torus, cylinder), or to the reference's, for random rays and for those that meet poles,
// seams, borders and planes of symmetry; lines cross closed surfaces an even number of times.
//
// SMURF_TEST_DENSE=50 makes it 100,000 rays a surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "harness/case.hpp"
#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/parametric_case.hpp"
#include "harness/tolerances.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "truth/parametric.hpp"

KERNELS(find_hits, list_open, finish_hits, count_blocks, order_rows);

namespace smurf::test {
namespace {

constexpr std::string_view kind = "parametric";
constexpr std::size_t random_rays = 2000, hostile_rays = 60;

Case case_of(const ParametricScene& scene, std::vector<RayFamily> rays) {
  Case one = case_of(scene);
  one.rays = std::move(rays);
  if (scene.equation.empty()) {
    one.oracle = [surface = one.surface, rules = rules_of(scene)](const RayFamily& family) {
      return oracle_by_reference(surface, family.rays, rules);
    };
  } else {
    one.oracle = [scene](const RayFamily& family) {
      return std::make_shared<ExactParametricOracle>(scene, family.rays);
    };
  }
  return one;
}

void expect_few_flagged(const std::map<std::string, Totals>& totals, const std::string& name) {
  for (const auto& [device, total] : totals) {
    // Fewer than one in ten thousand; of few rays, one may be.
    const double allowed = tolerance(Quantity::flagged_rays, kind).value * double(total.random.rays);
    EXPECT_LE(double(total.random.flagged_rays), std::max(allowed, 1.0)) << name << ", " << device;
  }
}

// Without `hostile` rays are random only: next to the pole of Boy's surface, where both ends of v meet and the surface
// has no sides, the reference is no judge.
void expect_right(const ParametricScene& scene, bool everywhere = false, bool hostile = true) {
  const auto many = std::size_t(density());
  std::vector<TestDevice> devices = devices_for_expressions(everywhere);
  std::vector<RayFamily> rays = parametric_families(scene, random_rays * many, hostile_rays * many, 7);
  if (!hostile) std::erase_if(rays, [](const RayFamily& family) { return !family.random; });
  const Case one = case_of(scene, std::move(rays));
  expect_few_flagged(run(one, devices), scene.name);
}

TEST(ParametricHits, Sphere) { expect_right(sphere_scene(1.5)); }
TEST(ParametricHits, Ellipsoid) { expect_right(ellipsoid_scene()); }
TEST(ParametricHits, Torus) { expect_right(torus_scene(2, 1), true); }
TEST(ParametricHits, Cylinder) { expect_right(cylinder_scene(1.25, 3)); }
TEST(ParametricHits, Helicoid) { expect_right(helicoid_scene()); }
TEST(ParametricHits, Enneper) { expect_right(enneper_scene()); }
TEST(ParametricHits, KleinBottle) { expect_right(klein_scene()); }
TEST(ParametricHits, BoysSurface) { expect_right(boy_scene(), false, false); }
TEST(ParametricHits, Pseudosphere) { expect_right(pseudosphere_scene()); }

// The reference, too, is held to closed forms.
TEST(ParametricHits, ReferenceAgreesWithClosedForms) {
  for (const ParametricScene& scene : algebraic_scenes()) {
    std::vector<TestDevice> devices{{"reference", "reference", 0, false, reference_device()}};
    run(case_of(scene, parametric_families(scene, 300, 30, 8)), devices);
  }
}

// A torus that is told in coordinates a million times as small or as large, far from the origin: to what floats keep of
// its place.
TEST(ParametricHits, SizesAndPlaces) {
  for (const double scale : {1e-6, 1e6}) {
    ParametricScene scene = torus_scene(2, 1);
    scene.name = "torus of size " + std::to_string(std::log10(scale));
    const auto at = scene.at;
    for (std::string& p : scene.position) p = std::to_string(scale) + "*(" + p + ")";
    scene.at = [at, scale](double u, double v) {
      PatchPoint p = at(u, v);
      for (glm::dvec3* x : {&p.position, &p.u, &p.v, &p.uu, &p.uv, &p.vv}) *x *= scale;
      return p;
    };
    scene.equation.clear();
    std::vector<TestDevice> devices = one_of_each();
    std::erase_if(devices, [](const TestDevice& device) { return device.name == "reference"; });
    run(case_of(scene, parametric_families(scene, 400, 10, 9)), devices);
  }
}

// Lines through closed surfaces, among them those through seams and poles. A million of each with SMURF_TEST_DENSE=50.
TEST(ParametricHits, LinesCrossClosedSurfacesEvenly) {
  TestDevice* device = test_device("opencl");
  if (!device) {
    report_missing("OpenCL");
    GTEST_SKIP() << "no OpenCL";
  }
  for (const ParametricScene& scene : {sphere_scene(1.5), torus_scene(2, 1), klein_scene(), boy_scene()}) {
    const Interrogator query(device->device, scene.surface());
    for (const RayFamily& family :
         parametric_families(scene, 10000 * std::size_t(density()), 500 * std::size_t(density()), 11)) {
      if (!family.valid) continue;
      RayBatch lines = family.rays;
      for (const auto end : {RayBatch::t_min, RayBatch::t_max})
        std::ranges::fill(lines.component(end), end == RayBatch::t_min ? -whole_line : whole_line);
      const HitList hits = query.cast(lines, {.hits = Hits::all});
      const std::size_t odd = odd_rays(hits), flagged = flagged_rays(hits);
      EXPECT_EQ(odd, 0u) << scene.name << ", " << family.name;
      if (family.random) {
        EXPECT_LE(double(flagged),
                  std::max(1.0, tolerance(Quantity::flagged_rays, kind).value * double(hits.ray_count())))
            << scene.name << ", " << family.name;
      }
    }
  }
}

// At poles and seams, and closer to them than floats can tell, the surface goes on: as many hits as roots, none of them
// twice, none left open, where the ray does not run along the surface.
TEST(ParametricHits, PolesAndSeamsAreTheSurface) {
  for (const ParametricScene& scene : {sphere_scene(1.5), ellipsoid_scene(), torus_scene(2, 1)}) {
    const AlgebraicRoots exact(scene);
    for (const RayFamily& family : parametric_families(scene, 1, 200 * std::size_t(density()), 13)) {
      if (family.name.find("pole") == std::string::npos && family.name.find("seam") == std::string::npos) continue;
      if (family.name.starts_with("along")) continue;  // tangent where no root is
      std::vector<Ray> rays;
      std::vector<std::size_t> roots;
      for (std::size_t i = 0; i < family.rays.size(); i++) {
        const Ray ray = family.rays[i];
        const ParametricRoots on = exact.on(ray);
        const bool clear =
            !on.doubtful && !on.at.empty() && std::ranges::all_of(on.at, [&](const ParametricRoot& root) {
              const PatchPoint p = scene.at(root.place.x, root.place.y);
              const glm::dvec3 normal = glm::cross(p.u, p.v), d(ray.direction);
              return root.certain && std::abs(glm::dot(normal, d)) > 0.1 * glm::length(normal) * glm::length(d);
            });
        if (!clear) continue;
        rays.push_back(ray);
        roots.push_back(on.at.size());
      }
      const RayBatch batch(rays);
      for (const TestDevice& device : devices_for_expressions(scene.name == "torus")) {
        const RayBatch some = device.slow ? first_rays(batch, 20) : batch;
        const HitList hits = Interrogator(device.device, scene.surface()).cast(some, {.hits = Hits::all});
        std::size_t wrong = 0;
        for (std::size_t i = 0; i < some.size(); i++)
          wrong += hits.offsets()[i + 1] - hits.offsets()[i] != roots[i] || is_flagged(hits, i);
        EXPECT_EQ(wrong, 0u) << scene.name << ", " << family.name << ", " << device.label << ", of " << some.size();
      }
    }
  }
}

// Rays that are finished apart have the hits that they have alone, whichever others are in the batch and in whatever
// order batches come.
TEST(ParametricHits, BatchesDoNotShow) {
  const ParametricScene scene = enneper_scene();
  for (const TestDevice& device : devices_for_expressions()) {
    const Interrogator query(device.device, scene.surface());
    std::size_t cast = 0;
    for (const RayFamily& family : parametric_families(scene, 40, 20, 7)) {
      if (!family.valid) continue;
      const HitList all = query.cast(family.rays, {.hits = Hits::all});
      cast += family.rays.size();
      std::size_t wrong = 0, first = 0;
      for (std::size_t i = 0; i < family.rays.size(); i++) {
        RayBatch one(1);
        one.set(0, family.rays[i]);
        const HitList alone = query.cast(one, {.hits = Hits::all});
        const auto from = all.t().subspan(all.offsets()[i], all.offsets()[i + 1] - all.offsets()[i]);
        if (!std::ranges::equal(from, alone.t()) && wrong++ == 0) first = i;
      }
      EXPECT_EQ(wrong, 0u) << family.name << ", " << device.label << ": of " << family.rays.size()
                           << " rays, the first is " << first;
    }
    EXPECT_GT(cast, 200u) << device.label;
  }
}

// Bad rays are flagged, or the call is refused.
TEST(ParametricHits, BadRays) {
  const ParametricScene scene = torus_scene(2, 1);
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, scene.surface());
    for (const RayFamily& family : parametric_families(scene, 32, 8, 12)) {
      if (family.valid) continue;
      const HitList hits = query.cast(family.rays, {.hits = Hits::all});
      EXPECT_EQ(hits.size(), 0u) << device.label;
      EXPECT_EQ(std::ranges::count(hits.ray_status(), RayStatus::invalid), std::ptrdiff_t(family.rays.size()))
          << device.label;
      EXPECT_THROW(query.cast(family.rays, {.bad_rays = BadRays::error}), Error) << device.label;
    }
  }
}

}  // namespace
}  // namespace smurf::test
