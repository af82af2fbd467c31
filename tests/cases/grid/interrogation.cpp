// What an interrogator promises beside correct roots: no hit is dropped, updates, memory, bad rays, properties on
// demand.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <iostream>
#include <limits>
#include <numbers>

#include "harness/grid_case.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/error.hpp"
#include "truth/analytic.hpp"

KERNELS(find_hits, count_blocks, order_rows, measure, grid_activate, grid_distances);

namespace smurf::test {
namespace {

Volume sphere_volume(int size = 16) {
  return sample(*sphere_field(glm::dvec3(0.49 * size), 0.31 * size), {.size = glm::ivec3(size)});
}

// Layers at right angles to x, four cells a period: a ray along x crosses 2 a period.
Volume layers_volume() { return sample(*layers_field({std::numbers::pi / 2, 0, 0}), {.size = {161, 6, 6}}); }

TEST(GridInterrogation, RaysWithMoreHitsThanAnyCapacity) {
  const Volume volume = layers_volume();
  for (Reconstruction reconstruction :
       {Reconstruction::trilinear, Reconstruction::tricubic, Reconstruction::catmull_rom}) {
    const GridCase c{.name = "layers, " + std::string(name_of(reconstruction)),
                     .volume = volume,
                     .isovalue = 0.25,
                     .reconstruction = reconstruction,
                     .random_rays = 4000,
                     .hostile_rays = 0};
    run(c);
    // Rays of 80 hits between rays of none, in one batch: each ray on its own gives the same.
    RayBatch rays(600);
    for (std::size_t i = 0; i < rays.size(); i++) {
      const float y = float(i % 50) * 0.1f;
      rays.set(i, i % 7 == 0 ? Ray{{-3, y, 2.3f}, {1, 0, 0}} : Ray{{-3, y, 2.3f}, {0, 1, 0}});
    }
    for (TestDevice& device : one_of_each()) {
      const Interrogator query(device.device, isosurface(volume, 0.25, {reconstruction}));
      const HitList hits = query.cast(rays, {.hits = Hits::all});
      for (std::size_t i = 0; i < rays.size(); i++)
        ASSERT_EQ(hits.offsets()[i + 1] - hits.offsets()[i], i % 7 == 0 ? 80u : 0u) << device.label << ", ray " << i;
      // By then the interrogator expects that many.
      EXPECT_TRUE(same_bytes(query.cast(rays, {.hits = Hits::all}), hits)) << device.label;
      // First hits of the same rays, from a start beyond some of them.
      RayBatch later = rays;
      for (float& t : later.component(RayBatch::t_min)) t = 100;
      const HitList first = query.cast(later, {.hits = Hits::first});
      for (std::size_t i = 0; i < rays.size(); i++)
        ASSERT_EQ(first.offsets()[i + 1] - first.offsets()[i], i % 7 == 0 ? 1u : 0u) << device.label << ", ray " << i;
    }
  }
}

TEST(GridInterrogation, UpdateEqualsAFreshInterrogator) {
  const Volume volume = sphere_volume();
  const RayBatch rays = random_chords(frame_of(volume), 2000, 4).rays;
  for (TestDevice& device : one_of_each()) {
    for (Reconstruction reconstruction :
         {Reconstruction::trilinear, Reconstruction::tricubic, Reconstruction::catmull_rom}) {
      Interrogator query(device.device, isosurface(volume, 0, {reconstruction}));
      const std::size_t bytes = query.device_bytes();
      for (double isovalue : {1.5, -0.75, 100.0, 0.25}) {
        const Surface next = isosurface(volume, isovalue, {reconstruction});
        query.update(next);
        const Interrogator fresh(device.device, next);
        const HitList a = query.cast(rays, {.hits = Hits::all}), b = fresh.cast(rays, {.hits = Hits::all});
        EXPECT_TRUE(same_bytes(a, b)) << device.label << ", isovalue " << isovalue;
        EXPECT_EQ(query.device_bytes(), bytes) << device.label;
      }
    }
  }
}

TEST(GridInterrogation, UpdateToAnotherVolume) {
  const Volume one = sphere_volume(16), other = sphere_volume(13);
  const RayBatch rays = random_chords(frame_of(other), 500, 4).rays;
  for (TestDevice& device : one_of_each()) {
    Interrogator query(device.device, isosurface(one, 0));
    const HitList before = query.cast(random_chords(frame_of(one), 200, 5).rays, {.hits = Hits::all});
    const std::vector<float> t(before.t().begin(), before.t().end());
    query.update(isosurface(other, 0.5));
    const Interrogator fresh(device.device, isosurface(other, 0.5));
    EXPECT_TRUE(same_bytes(query.cast(rays, {.hits = Hits::all}), fresh.cast(rays, {.hits = Hits::all})))
        << device.label;
    EXPECT_TRUE(std::equal(t.begin(), t.end(), before.t().begin())) << device.label << ": an earlier list changed";
  }
}

// For a float volume of n³: at most 2.5·4n³ bytes for tricubic, whose coefficients stand beside nothing else.
TEST(GridInterrogation, MemoryOfAVolume) {
  const int n = 96;
  const Volume volume = sphere_volume(n);
  for (const char* executor : {"opencl", "vulkan"}) {
    TestDevice* device = test_device(executor);
    if (!device) continue;  // said loudly when the devices were opened, and a failure in CI
    for (Reconstruction reconstruction :
         {Reconstruction::trilinear, Reconstruction::tricubic, Reconstruction::catmull_rom}) {
      const Interrogator query(device->device, isosurface(volume, 0, {reconstruction}));
      const double share = double(query.device_bytes()) / double(volume.bytes());
      std::cerr << "  " << executor << ", " << name_of(reconstruction) << ": " << share << " of the volume\n";
      EXPECT_GE(share, 0.01);
      EXPECT_LE(share, 2.5) << executor << ", " << name_of(reconstruction);
    }
  }
}

TEST(GridInterrogation, BadRaysAreFlaggedOrRefused) {
  const Volume volume = sphere_volume();
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  RayBatch rays = random_chords(frame_of(volume), 40, 4).rays;
  const RayBatch good = rays;
  Ray bad = rays[7];
  bad.direction.y = nan;
  rays.set(7, bad);
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, isosurface(volume, 0));
    const HitList hits = query.cast(rays, {.hits = Hits::all}), all = query.cast(good, {.hits = Hits::all});
    for (std::size_t i = 0; i < rays.size(); i++) {
      EXPECT_EQ(hits.ray_status()[i], i == 7 ? RayStatus::invalid : RayStatus::ok) << device.label;
      EXPECT_EQ(hits.offsets()[i + 1] - hits.offsets()[i], i == 7 ? 0 : all.offsets()[i + 1] - all.offsets()[i])
          << device.label;
    }
    try {
      query.cast(rays, {.bad_rays = BadRays::error});
      ADD_FAILURE() << device.label << ": the bad ray was not refused";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::input) << device.label;
      EXPECT_NE(std::string(error.what()).find("7"), std::string::npos) << device.label << ": " << error.what();
    }
    EXPECT_EQ(query.cast(good, {.bad_rays = BadRays::error}).ray_count(), 40u) << device.label;
  }
}

TEST(GridInterrogation, EmptyBatches) {
  const Volume volume = sphere_volume();
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, isosurface(volume, 0));
    const HitList hits = query.cast(RayBatch());
    EXPECT_EQ(hits.ray_count(), 0u);
    EXPECT_EQ(hits.size(), 0u);
    EXPECT_TRUE(hits.normals().empty());
    EXPECT_TRUE(query.probe({}, std::uint32_t(Property::normal)).normal.empty());
    // A batch that misses has rows, but no hits.
    RayBatch away(5);
    for (float& x : away.component(RayBatch::origin_x)) x = 1e6f;
    const HitList none = query.cast(away);
    EXPECT_EQ(none.ray_count(), 5u);
    EXPECT_TRUE(none.principal_curvatures().empty());
  }
}

TEST(GridInterrogation, PropertiesAlongWithHitsAreThoseOnDemand) {
  const Volume volume = sphere_volume();
  const RayBatch rays = random_chords(frame_of(volume), 700, 4).rays;
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, isosurface(volume, 0.5));
    const HitList lazy = query.cast(rays, {.hits = Hits::all});
    const HitList eager = query.cast(
        rays, {.hits = Hits::all, .properties = Property::normal | Property::gauss | Property::principal, .tile = 100});
    ASSERT_EQ(lazy.size(), eager.size());
    EXPECT_TRUE(std::ranges::equal(lazy.normals(), eager.normals())) << device.label;
    EXPECT_TRUE(std::ranges::equal(lazy.gauss_curvatures(), eager.gauss_curvatures())) << device.label;
    EXPECT_TRUE(std::ranges::equal(lazy.principal_curvatures(), eager.principal_curvatures())) << device.label;
    // Kept: the same memory when asked again.
    EXPECT_EQ(lazy.normals().data(), lazy.normals().data());
    // A list outlives its interrogator.
    HitList kept = [&] {
      return Interrogator(device.device, isosurface(volume, 0.5)).cast(rays, {.hits = Hits::all});
    }();
    EXPECT_TRUE(std::ranges::equal(kept.mean_curvatures(), lazy.mean_curvatures())) << device.label;
  }
}

TEST(GridInterrogation, ProbesOutsideAreUndefined) {
  const Volume volume = sphere_volume();
  // Points of the border count as inside; at its corners the mirrored field would have no gradient.
  const std::vector<glm::vec3> points{{-1, 3, 3},       {3, 3, 3},   {3, 3, 15.5f},   {0, 2.5f, 4.5f},
                                      {15, 9.5f, 3.5f}, {NAN, 1, 1}, {INFINITY, 1, 1}};
  const bool outside[] = {true, false, true, false, false, true, true};
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, isosurface(volume, 0));
    const PointProperties p = query.probe(points, Property::value | Property::normal | Property::principal);
    for (std::size_t i = 0; i < points.size(); i++) {
      EXPECT_EQ((p.status[i] & PointStatus::undefined) != 0, outside[i]) << device.label << ", point " << i;
      EXPECT_EQ(std::isnan(p.value[i]), outside[i]) << device.label << ", point " << i;
      EXPECT_EQ(std::isnan(p.normal[i].x), outside[i]) << device.label << ", point " << i;
      EXPECT_EQ(std::isnan(p.k1[i]), outside[i]) << device.label << ", point " << i;
    }
  }
}

TEST(GridInterrogation, UmbilicPointsSaySo) {
  // On a quadratic bowl's axis both curvatures agree; Catmull-Rom reproduces it exactly.
  std::array<double, 64> c{};
  c[2] = c[8] = 1;  // x² + y²
  c[16] = 1;        // z
  const glm::ivec3 size(9);
  const Volume volume = sample(*polynomial_field(c, glm::dmat3(0.25), glm::dvec3(-1.0)), {.size = size});
  const std::vector<glm::vec3> points{{4, 4, 4}, {6.5f, 4, 4}};
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, isosurface(volume, 0, {Reconstruction::catmull_rom}));
    const PointProperties p = query.probe(points, Property::principal | Property::directions);
    EXPECT_TRUE(p.status[0] & PointStatus::umbilic) << device.label;
    EXPECT_FALSE(p.status[1] & PointStatus::umbilic) << device.label;
    EXPECT_NEAR(glm::length(p.d1[0]), 1, 1e-5) << device.label << ": arbitrary, but of length 1";
    EXPECT_NEAR(p.k1[0], p.k2[0], 1e-4 * std::abs(p.k1[0])) << device.label;
  }
}

// Hits on the faces of the domain count, as the domain is closed: rays in its faces, exactly representable.
TEST(GridInterrogation, RaysInTheFacesOfTheDomain) {
  const Volume volume = sample(*cylinder_field({4.3, 4.4, 0}, {0, 0, 1}, 2.6), {.size = {9, 9, 5}});
  RayBatch rays(18);
  for (std::size_t i = 0; i < 18; i++) rays.set(i, {{-2, float(i % 9) + 0.25f, i < 9 ? 0.0f : 4.0f}, {1, 0, 0}});
  for (TestDevice& device : one_of_each()) {
    for (Reconstruction reconstruction :
         {Reconstruction::trilinear, Reconstruction::tricubic, Reconstruction::catmull_rom}) {
      const Interrogator query(device.device, isosurface(volume, 0, {reconstruction}));
      const HitList hits = query.cast(rays, {.hits = Hits::all});
      for (std::size_t i = 0; i < 18; i++) {
        const bool crosses = std::abs(double(i % 9) + 0.25 - 4.4) < 2.5;
        EXPECT_EQ(hits.offsets()[i + 1] - hits.offsets()[i], crosses ? 2u : 0u) << device.label << ", ray " << i;
      }
    }
  }
}

}  // namespace
}  // namespace smurf::test
