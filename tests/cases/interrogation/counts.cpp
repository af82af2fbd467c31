// Casts for any hit and for numbers of hits, on every device: the same as a list of all hits has, also where hits are
// flagged, where rays have more hits than there is room for at first, and for invalid rays.
#include <gtest/gtest.h>

#include <string>

#include "cases/interrogation/surfaces.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/refusal.hpp"
#include "smurf/interrogator.hpp"
#include "truth/rays.hpp"

KERNELS(find_hits, count_blocks, count_flagged, finish_hits);

namespace smurf::test {
namespace {

bool is_flagged(HitStatus status) { return status == HitStatus::tangent || status == HitStatus::unresolved; }

// Returns how many hits there are in all, and how many are flagged.
struct Sums {
  std::size_t hits = 0, flagged = 0;
};

Sums expect_counts(const Interrogator& query, const RayBatch& rays, const std::string& where) {
  const HitList all = query.cast(rays, {.hits = Hits::all}), counted = query.cast(rays, {.hits = Hits::count}),
                any = query.cast(rays, {.hits = Hits::any, .tile = 777});
  Sums sums;
  EXPECT_EQ(counted.size(), 0u);
  EXPECT_EQ(any.size(), 0u);
  EXPECT_EQ(counted.ray_count(), rays.size());
  EXPECT_EQ(any.ray_count(), rays.size());
  if (counted.counts().size() != rays.size() || any.counts().size() != rays.size()) {
    ADD_FAILURE() << where << ": not a count for each ray";
    return sums;
  }
  std::size_t wrong = 0, wrong_any = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    std::uint32_t total = 0, flagged = 0;
    for (std::size_t h = all.offsets()[i]; h < all.offsets()[i + 1]; h++) {
      total++;
      flagged += is_flagged(all.status()[h]) ? 1 : 0;
    }
    wrong += counted.counts()[i] != total || counted.flagged()[i] != flagged ? 1 : 0;
    wrong_any +=
        any.counts()[i] != (total > 0 ? 1u : 0u) || any.flagged()[i] != (total > 0 && flagged == total ? 1u : 0u) ? 1
                                                                                                                  : 0;
    EXPECT_EQ(counted.ray_status()[i], all.ray_status()[i]);
    EXPECT_EQ(any.ray_status()[i], all.ray_status()[i]);
    sums.hits += total;
    sums.flagged += flagged;
  }
  EXPECT_EQ(wrong, 0u) << where << ": rays of " << rays.size() << " whose count is not that of all hits";
  EXPECT_EQ(wrong_any, 0u) << where << ": rays of " << rays.size() << " told wrongly to have a hit or none";
  return sums;
}

RayBatch first_of(const RayBatch& rays, std::size_t count) {
  RayBatch some(count);
  for (std::size_t i = 0; i < count; i++) some.set(i, rays[i]);
  return some;
}

TEST(Counts, SpheresOfEveryKind) {
  const RayBatch rays = sphere_chords(glm::vec3(-1.2f), glm::vec3(1.2f), 3000, 5);
  for (const auto& [name, surface] : spheres()) {
    for (TestDevice& device : one_of_each()) {
      const Interrogator query(device.device, surface);
      const Sums sums = expect_counts(query, device.slow ? first_of(rays, 800) : rays, name + " on " + device.label);
      EXPECT_GT(sums.hits, 300u) << name << " on " << device.label;
    }
  }
}

// Spatial splits name triangles twice, which are counted once; on one lane rays go in packets only.
TEST(Counts, SplitTriangles) {
  const Surface surface = mesh_surface(torus_mesh(3, 1, 48, 24), MeshNormals::face, true);
  const RayBatch rays = sphere_chords(glm::vec3(-4, -4, -1), glm::vec3(4, 4, 1), 2000, 6);
  for (TestDevice& device : test_devices()) {
    if (device.lanes == 1 || device.lanes == 16)
      expect_counts(Interrogator(device.device, surface), rays, device.label);
  }
}

// Twenty-four layers.
TEST(Counts, MoreHitsThanRoom) {
  const Surface surface = implicit("cos(25*x)", {glm::dvec3(-1.5), glm::dvec3(1.5)});
  RayBatch rays(64);
  for (std::size_t i = 0; i < rays.size(); i++)
    rays.set(i, {glm::vec3(-2, 0.01f * float(i), 0.1f), glm::vec3(1, 0.003f * float(i), 0)});
  for (TestDevice& device : one_of_each()) {
    const Sums sums = expect_counts(Interrogator(device.device, surface), rays, device.label);
    EXPECT_EQ(sums.hits, 64u * 24u) << device.label;
  }
}

// A double root, which stays tangent, in front of a single one; and a ray with the double one alone.
TEST(Counts, FlaggedHits) {
  const Surface surface = implicit("(z-0.5)^2*(z-0.25)", {glm::dvec3(0), glm::dvec3(1)});
  RayBatch rays(3);
  rays.set(0, {glm::vec3(0.3f, 0.4f, 2), glm::vec3(0, 0, -1)});
  rays.set(1, {glm::vec3(0.3f, 0.4f, 2), glm::vec3(0, 0, -1), 0.0f, 1.6f});
  rays.set(2, {glm::vec3(0.3f, 0.4f, 2), glm::vec3(0, 0, -1), 0.0f, 1.3f});
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, surface);
    const Sums sums = expect_counts(query, rays, device.label);
    EXPECT_EQ(sums.hits, 3u) << device.label;
    EXPECT_EQ(sums.flagged, 2u) << device.label;
    const HitList any = query.cast(rays, {.hits = Hits::any});
    EXPECT_EQ(std::vector<std::uint32_t>(any.flagged().begin(), any.flagged().end()),
              (std::vector<std::uint32_t>{0, 1, 0}))
        << device.label;
  }
}

TEST(Counts, InvalidRays) {
  const Surface surface = implicit("x^2+y^2+z^2-1", {glm::dvec3(-2), glm::dvec3(2)});
  RayBatch rays(2);
  rays.set(0, {glm::vec3(0, 0, -3), glm::vec3(0)});
  rays.set(1, {glm::vec3(0, 0, -3), glm::vec3(0, 0, 1)});
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, surface);
    expect_counts(query, rays, device.label);
    refusal(ErrorCode::input, [&] { query.cast(rays, {.hits = Hits::any, .bad_rays = BadRays::error}); });
    refusal(ErrorCode::usage,
            [&] { query.cast(rays, {.hits = Hits::count, .properties = std::uint32_t(Property::normal)}); });
    EXPECT_EQ(query.cast(RayBatch(0), {.hits = Hits::count}).ray_count(), 0u);
  }
}

}  // namespace
}  // namespace smurf::test
