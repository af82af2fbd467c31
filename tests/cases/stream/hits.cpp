// Rays against stream surfaces of which all is known (truth/stream/scenes.hpp), on every device and the reference:
// counts, t and (u, τ), normals and curvature; expressions and the same field on a grid, seeds with corners, times
// before the seed and that leave it out. SMURF_TEST_DENSE=n makes it n times as many rays.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/stream_case.hpp"
#include "harness/tolerances.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"

KERNELS(find_hits, finish_hits, measure, find_nearest);

namespace smurf::test {
namespace {

constexpr std::string_view kind = "stream";
constexpr std::array methods{StreamMethod::mesh, StreamMethod::back_stream};

// `count` rays on OpenCL with 16 lanes, a hundredth of them on devices that are slow.
constexpr std::size_t slow_share = 100, most_slow = 1000;

const double place = tolerance(Quantity::place, kind).value;

StreamOptions options_for(const StreamScene& scene, StreamMethod method) {
  return {.method = method, .tolerance = place * extent_of(scene)};
}

Case case_for(const StreamScene& scene, StreamMethod method, std::size_t random, std::size_t hostile) {
  Case one = case_of(scene, options_for(scene, method), place);
  one.rays = stream_rays(scene, random, hostile, 21);
  // Rays within the surface from one border to another: by the back-stream method they have more than one hit.
  if (method == StreamMethod::back_stream)
    std::erase_if(one.rays, [](const RayFamily& family) { return family.name == "from seam to seam"; });
  one.slow_share = std::max<std::size_t>(slow_share, random / most_slow);
  one.properties = 2000;
  return one;
}

void expect_few_flagged(const Totals& total, const std::string& where) {
  // Drivers that end loops leave some rays of the back-stream method unresolved.
  const double part = where.find("back-stream") != where.npos ? 2e-2 : tolerance(Quantity::flagged_rays, kind).value;
  EXPECT_LE(double(total.random.flagged_rays), std::max(part * double(total.random.rays), 1.0)) << where;
}

// Hits of all families on one device, their coordinates and what is measured there.
HitList expect_right(const StreamScene& scene, const Case& one, TestDevice& device) {
  SCOPED_TRACE(one.name + " on " + device.label);
  const Interrogator query(device.device, one.surface);
  Totals total;
  HitList chords;
  for (const RayFamily& family : one.rays) {
    const std::string where = fmt::format("{}, {}, on {}", one.name, family.name, device.label);
    RayFamily asked = family;
    if (device.device.is_reference()) asked.rays = first_rays(family.rays, family.rays.size() / one.slow_share + 16);
    Judged judged = expect_hits(one, asked, *one.oracle(asked), device, query);
    (family.random ? total.random : total.hostile).add(judged.verdict);
    if (!family.valid) continue;
    expect_distinct(scene, judged.hits, where);
    if (!family.random) continue;
    const RayBatch few = first_rays(asked.rays, device.slow || device.device.is_reference() ? 100 : 2000);
    const HitList all = query.cast(few, {.hits = Hits::all});
    expect_first(all, query.cast(few, {.hits = Hits::first}), where);
    expect_stream_properties(scene, one, all, where);
    if (chords.size() == 0) chords = std::move(judged.hits);
  }
  std::cerr << "  " << one.name << ", " << device.label << "\n    random:  " << total.random.summary()
            << "\n    hostile: " << total.hostile.summary() << "\n";
  EXPECT_GT(total.random.roots, total.random.rays / 10);
  expect_few_flagged(total, one.name + " on " + device.label);
  return chords;
}

class StreamHits : public testing::TestWithParam<std::tuple<int, StreamMethod>> {};

TEST_P(StreamHits, AreThoseOfClosedForms) {
  const auto [index, method] = GetParam();
  const StreamScene scene = stream_scenes()[std::size_t(index)];
  const std::size_t many = std::size_t(density()), part = sanitized_part;
  // The truth of ruled surfaces looks along all of them.
  const std::size_t random = (scene.name == "spiral" ? 4000 : 50'000) * many / part;
  const Case one = case_for(scene, method, random, 40 * many);
  for (TestDevice& device : one_of_each()) expect_right(scene, one, device);
}

std::string name_of_case(const testing::TestParamInfo<StreamHits::ParamType>& info) {
  const auto [index, method] = info.param;
  return fmt::format("{}{}", method == StreamMethod::mesh ? "Mesh" : "BackStream", index);
}

// By their places in stream_scenes(). Not there yet: rays that meet two sheets that lie on each other, which may be
// told as one (a torus that passes over itself, 7; folds of a swirl, 9); curvature next to where streamlines leave the
// field, and the number of flagged rays there (5); full turns by the back-stream method (6), where 2 of 160,662 hits are
// off by 1.2e-6 of the extent.
INSTANTIATE_TEST_SUITE_P(Mesh, StreamHits,
                         testing::Combine(testing::Values(0, 1, 2, 3, 4, 6, 8), testing::Values(StreamMethod::mesh)),
                         name_of_case);
INSTANTIATE_TEST_SUITE_P(BackStream, StreamHits,
                         testing::Combine(testing::ValuesIn(density() > 1 ? std::vector{0, 1, 2, 3, 4, 8}
                                                                          : std::vector{0, 2, 4}),
                                          testing::Values(StreamMethod::back_stream)),
                         name_of_case);

// The number of lanes does not show, and neither do tiles.
TEST(StreamHitsOnLanes, AreTheSame) {
  for (const StreamMethod method : methods) {
    Case one = case_for(helicoid_stream(), method, 2000 * std::size_t(density()), 20);
    std::vector<TestDevice> devices;
    for (const TestDevice& device : test_devices())
      if (!device.slow) devices.push_back(device);
    if (devices.empty()) {
      report_missing("OpenCL");
      GTEST_SKIP() << "no OpenCL";
    }
    for (const auto& [label, total] : run(one, devices)) expect_few_flagged(total, label);
  }
}

// Splines reproduce fields that are affine; what is left is the rounding of nodes to floats.
TEST(StreamHitsOnGrids, AreThoseOfTheExpression) {
  const StreamScene scene = helicoid_stream();
  const VectorField field = helicoid_on_grid({9, 9, 8}, VectorReconstruction::tricubic);
  for (const StreamMethod method : methods) {
    Case one = case_for(scene, method, 5000 * std::size_t(density()) / sanitized_part, 20);
    StreamOptions options = options_for(scene, method);
    options.time = scene.time;
    one.name += ", on a grid";
    one.surface = stream_surface(field, scene.seeds(), options);
    one.replay = {};
    for (TestDevice& device : one_of_each()) expect_right(scene, one, device);
  }
}

// Points beside the surface find the place that they stand over. A float of a point is as exact as the surface is, and
// the nearest point of a surface that is tilted by a little moves along it by as much of the distance.
TEST(StreamNearest, PointsBesideTheSurfaceFindIt) {
  for (const StreamScene& scene : {helicoid_stream({-3, 2}), graph_stream(), corner_stream()}) {
    const double extent = extent_of(scene), beside = 3e-3;
    for (const StreamMethod method : methods) {
      const Surface surface = scene.surface(options_for(scene, method));
      for (const TestDevice& device : one_of_each()) {
        SCOPED_TRACE(scene.name + " on " + device.label);
        std::vector<glm::vec3> points;
        std::vector<glm::dvec3> feet;
        for (int k = 0; k < 81; k++) {
          // Clear of borders, and of the corner at the middle of u.
          const glm::dvec2 part((k % 9 + 1.27) / 11, (k / 9 + 1.4) / 11);
          const PatchPoint p =
              scene.at(std::lerp(scene.range.x, scene.range.y, part.x), std::lerp(scene.time.x, scene.time.y, part.y));
          const glm::dvec3 normal = glm::normalize(glm::cross(p.u, p.v));
          points.emplace_back(p.position + (k % 2 ? beside : -beside) * extent * normal);
          feet.push_back(p.position);
        }
        const PointProperties found =
            Interrogator(device.device, surface).probe(points, Property::location | Property::normal);
        double greatest = 0;
        for (std::size_t i = 0; i < points.size(); i++) {
          const double off = glm::distance(glm::dvec3(found.location[i]), feet[i]);
          greatest = std::isnan(off) ? HUGE_VAL : std::max(greatest, off);
        }
        EXPECT_LE(greatest, 3 * place * extent);
      }
    }
  }
}

}  // namespace
}  // namespace smurf::test
