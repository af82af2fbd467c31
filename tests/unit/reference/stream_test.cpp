// Stream surfaces by the reference, against closed forms: counts, t and (u, τ), normals and curvature; and what it
// refuses.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include "harness/density.hpp"
#include "harness/refusal.hpp"
#include "harness/stream_case.hpp"
#include "harness/tolerances.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"

namespace smurf::test {
namespace {

constexpr std::string_view kind = "stream";

std::vector<TestDevice> reference_alone() { return {{"reference", "reference", 0, false, reference_device()}}; }

class StreamReferenceTest : public testing::TestWithParam<int> {};

TEST_P(StreamReferenceTest, AgreesWithClosedForms) {
  const StreamScene scene = stream_scenes()[std::size_t(GetParam())];
  const auto many = std::size_t(density());
  Case one = case_of(scene, {}, tolerance(Quantity::place, kind, Precision::float64).value);
  one.rays = stream_rays(scene, 1000 * many / sanitized_part, 40 * many, 5);
  one.properties = 40;
  const TestDevice device = reference_alone()[0];
  const Interrogator query(device.device, one.surface);
  Totals total;
  for (const RayFamily& family : one.rays) {
    const Judged judged = expect_hits(one, family, *one.oracle(family), device, query);
    (family.random ? total.random : total.hostile).add(judged.verdict);
    expect_distinct(scene, judged.hits, scene.name + ", " + family.name);
    if (family.random) {
      const auto few = query.cast(first_rays(family.rays, 40), {.hits = Hits::all});
      expect_stream_properties(scene, one, few, scene.name + ", " + family.name);
    }
  }
  EXPECT_GT(total.random.roots, total.random.rays / 10);
  EXPECT_LE(total.random.flagged_rays, 1u);
  std::cerr << "  " << scene.name << "\n    random:  " << total.random.summary()
            << "\n    hostile: " << total.hostile.summary() << "\n";
}

INSTANTIATE_TEST_SUITE_P(All, StreamReferenceTest, testing::Range(0, int(stream_scenes().size())));

}  // namespace
}  // namespace smurf::test
