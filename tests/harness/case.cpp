#include "harness/case.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <random>

namespace smurf::test {
namespace {

// Runs, tiles and first hits, on chords and on the pixels of cameras; and properties of what was hit.
void expect_steadiness(const Case& one, TestDevice& device, const Interrogator& query) {
  for (const RayFamily& family : one.rays) {
    if (!family.random) continue;
    const std::string where = fmt::format("{}, {}, on {}", one.name, family.name, device.label);
    const RayBatch rays = first_rays(family.rays, device.slow ? 512 : 8192);
    const HitList all = query.cast(rays, {.hits = Hits::all});
    EXPECT_TRUE(same_bytes(all, query.cast(rays, {.hits = Hits::all}))) << where << ": two runs differ";
    EXPECT_TRUE(same_bytes(all, query.cast(rays, {.hits = Hits::all, .tile = 1000})))
        << where << ": the tile's size shows";
    expect_first(all, query.cast(rays, {.hits = Hits::first}), where);
    if (one.points) expect_properties(one, one.points, all, where);
  }
}

}  // namespace

RayBatch first_rays(const RayBatch& rays, std::size_t count) {
  if (rays.image_width) count = (count + rays.image_width - 1) / rays.image_width * rays.image_width;
  count = std::min(count, rays.size());
  RayBatch out(count);
  out.image_width = rays.image_width;
  for (std::size_t i = 0; i < count; i++) out.set(i, rays[i]);
  return out;
}

Verdict expect_hits(const Case& one, const std::string& family, const RayBatch& rays, const Oracle& oracle,
                    const TestDevice& device, const HitList& hits) {
  const Verdict verdict = judge(hits, oracle, rays);
  if (verdict.failures() > 0) {
    ADD_FAILURE() << one.name << ", " << family << ", on " << device.label << ": " << verdict.summary()
                  << "\n  worst: ray " << verdict.worst_ray << ": " << verdict.worst << "\n  replay: "
                  << (one.replay ? one.replay(one.name + " " + family, rays[verdict.worst_ray], device.name) : "none");
  }
  return verdict;
}

Judged expect_hits(const Case& one, const RayFamily& family, const Oracle& oracle, const TestDevice& device,
                   const Interrogator& query, const Judged* known) {
  const std::string where = fmt::format("{}, {}, on {}", one.name, family.name, device.label);
  const RayBatch rays = device.slow ? first_rays(family.rays, family.rays.size() / one.slow_share + 16) : family.rays;
  const HitList hits = query.cast(rays, {.hits = Hits::all});
  EXPECT_EQ(hits.ray_count(), rays.size()) << where;
  if (hits.ray_count() != rays.size()) return {};
  if (known && same_bytes(hits, known->hits)) return *known;

  if (!family.valid) {
    EXPECT_EQ(hits.size(), 0u) << where << ": invalid rays have no hits";
    EXPECT_EQ(std::ranges::count(hits.ray_status(), RayStatus::invalid), std::ptrdiff_t(rays.size())) << where;
    return {hits, {}};
  }
  return {hits, expect_hits(one, family.name, rays, oracle, device, hits)};
}

void expect_properties(const Case& one, const PointOracle& points, const HitList& hits, const std::string& where) {
  if (hits.size() == 0) return;
  std::mt19937 random(one.seed);
  std::normal_distribution<float> normal;
  std::vector<glm::vec3> directions(hits.size());
  for (glm::vec3& d : directions) d = glm::vec3(normal(random), normal(random), normal(random));
  // Each property on demand, as users ask.
  hits.normals();
  hits.first_principal_directions();
  hits.second_principal_directions();
  hits.gauss_curvatures();
  hits.mean_curvatures();
  hits.principal_curvatures();
  const auto along = hits.normal_curvatures(directions);
  const PointProperties& measured =
      hits.properties(Property::normal | Property::directions | Property::gauss | Property::mean | Property::principal);
  const PointErrors errors =
      compare_points(measured, hits.locations(), one.properties, points, directions, std::span<const float>(along));
  expect_points(errors, hits.locations(), where);
  if (testing::Test::HasFailure()) std::cerr << "  " << where << ": error / tolerance:" << errors.summary() << "\n";
}

std::map<std::string, Totals> run(const Case& one) {
  EXPECT_FALSE(test_devices().empty()) << "no device at all";
  return run(one, test_devices());
}

std::map<std::string, Totals> run(const Case& one, std::span<TestDevice> devices) {
  std::vector<std::shared_ptr<const Oracle>> oracles;
  for (const RayFamily& family : one.rays) oracles.push_back(one.oracle(family));

  std::map<std::string, Totals> totals;
  std::vector<Judged> base;  // of the first device that is not slow
  for (TestDevice& device : devices) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, one.surface);
    const bool first = base.empty() && !device.slow;
    Totals& total = totals[device.label];
    for (std::size_t i = 0; i < one.rays.size(); i++) {
      const RayFamily& family = one.rays[i];
      const Judged* known = !device.slow && !base.empty() && !first ? &base[i] : nullptr;
      Judged judged = expect_hits(one, family, *oracles[i], device, query, known);
      (family.random ? total.random : total.hostile).add(judged.verdict);
      if (known && device.name == "opencl") {
        EXPECT_TRUE(same_bytes(known->hits, judged.hits))
            << one.name << ", " << family.name << ", on " << device.label << ": the number of lanes shows";
      }
      if (first) base.push_back(std::move(judged));
    }
    if (first || device.slow) {
      std::cerr << "  " << one.name << ", " << device.label << "\n    random:  " << total.random.summary()
                << "\n    hostile: " << total.hostile.summary() << "\n";
    }
    expect_steadiness(one, device, query);
  }
  return totals;
}

}  // namespace smurf::test
