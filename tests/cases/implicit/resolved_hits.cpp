// Hits that floats cannot decide, and what double precision makes of them (host/api/resolve_hits.hpp), on every device:
// sheets that nearly touch, close pairs, double roots, creases and poles, in lists of all hits and as first hits.
//
// Rays are oblique, with directions that floats hold exactly, and cross the planes z = const where z = -1 + t.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "harness/compile_at_most.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/interrogator.hpp"

KERNELS(find_hits, count_blocks, order_rows, measure);

namespace smurf::test {
namespace {

// What is decided is decided on the host, whatever the lanes.
std::vector<TestDevice> deciding_devices() {
  std::vector<TestDevice> devices;
  for (const char* executor : {"opencl", "vulkan"}) {
    // A device that is missing is reported where devices are opened.
    if (const TestDevice* device = test_device(executor)) devices.push_back(*device);
  }
  return devices;
}

const Domain domain{glm::dvec3(-1), glm::dvec3(1), 0};

// Row by row over x and y; every seventh ray misses the domain.
RayBatch oblique_rays(std::size_t count = 70) {
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const glm::vec3 origin(-0.25f + 0.015625f * float(i % 10), -0.125f + 0.0078125f * float(i / 10), -1.0f);
    rays.set(i, {i % 7 == 3 ? origin + glm::vec3(5, 0, 0) : origin, glm::vec3(0.25f, 0.125f, 1.0f)});
  }
  return rays;
}

struct Expected {
  double t;
  HitStatus status = HitStatus::isolated;
};

// Every ray that does not miss must have these hits.
// Expressions are interpreted, by programs that they share: compiling each takes seconds.
void expect_hits(const std::string& equation, const std::vector<Expected>& expected, Hits wanted = Hits::all,
                 float t_min = 0, float t_max = std::numeric_limits<float>::infinity(), const char* compiled = "0",
                 double level = 0) {
  const CompileAtMost operations(compiled);
  RayBatch rays = oblique_rays();
  std::ranges::fill(rays.component(RayBatch::t_min), t_min);
  std::ranges::fill(rays.component(RayBatch::t_max), t_max);
  for (const TestDevice& device : deciding_devices()) {
    SCOPED_TRACE(equation + " on " + device.label);
    const HitList hits = Interrogator(device.device, isosurface(equation, level, domain))
                             .cast(rays, {.hits = wanted, .properties = std::uint32_t(Property::normal), .tile = 32});
    ASSERT_EQ(hits.ray_count(), rays.size());
    ASSERT_EQ(hits.offsets().back(), hits.size());
    ASSERT_EQ(hits.locations().size(), hits.size());
    ASSERT_EQ(hits.normals().size(), hits.size());
    for (std::size_t i = 0; i < rays.size(); i++) {
      const std::size_t begin = hits.offsets()[i], count = hits.offsets()[i + 1] - begin;
      ASSERT_EQ(count, i % 7 == 3 ? 0 : expected.size()) << "ray " << i;
      for (std::size_t k = 0; k < count; k++) {
        const std::size_t h = begin + k;
        EXPECT_EQ(hits.rays()[h], i);
        EXPECT_EQ(hits.status()[h], expected[k].status) << "ray " << i << ", hit " << k;
        const double off = std::abs(double(hits.t()[h]) - expected[k].t);
        EXPECT_LE(off, hits.uncertainty()[h] + 1e-12) << "ray " << i << ", hit " << k;
        EXPECT_LE(hits.uncertainty()[h], hits.status()[h] == HitStatus::isolated ? 1e-6f : 1e-5f);
        const glm::dvec3 place = glm::dvec3(rays[i].origin) + double(hits.t()[h]) * glm::dvec3(rays[i].direction);
        EXPECT_LT(glm::length(place - glm::dvec3(hits.locations()[h])), 2e-7);
        EXPECT_GE(hits.t()[h], t_min);
        EXPECT_LE(hits.t()[h], t_max);
      }
    }
  }
}

TEST(DecidedHits, NearMissesAreNoHits) {
  expect_hits("(z-0.5)^2+1e-9", {});
  expect_hits("(z-0.5)^2+1e-9", {}, Hits::first);
  expect_hits("cos(z)-1-1e-9", {});
  // Written out, its terms cancel.
  expect_hits("z^2-z+0.250000001", {});
}

TEST(DecidedHits, ClosePairsAreTwo) {
  for (const double z : {0.5, 0.3}) {
    const std::vector<Expected> pair{{1 + z}, {1 + (z + 1e-6)}};
    const std::string text = fmt::format("(z-{:.17g})*(z-{:.17g})", z, z + 1e-6);
    expect_hits(text, pair);
    expect_hits(text, {pair[0]}, Hits::first);
    expect_hits("-" + text + "*(x+4)", pair);
  }
  // Compiled.
  expect_hits("(z-0.5)*(z-0.500001)", {{1.5}, {1 + 0.500001}}, Hits::all, 0, 4, "400");
  // Two pairs and a single one, each of which is decided by itself.
  expect_hits("(z+0.5)*(z+0.499999)*(z-0.25)*(z-0.5)*(z-0.500001)",
              {{0.5}, {1 - 0.499999}, {1.25}, {1.5}, {1 + 0.500001}});
}

TEST(DecidedHits, DoubleRootsStayTangent) {
  expect_hits("(z-0.5)^2", {{1.5, HitStatus::tangent}});
  expect_hits("(z-0.5)^2", {{1.5, HitStatus::tangent}}, Hits::first);
  expect_hits("(z-0.25)*(z-0.5)^2", {{1.25}, {1.5, HitStatus::tangent}});
  expect_hits("abs(z-0.5)", {{1.5, HitStatus::tangent}});
}

TEST(DecidedHits, FirstHitsAreLookedForBehindNearMisses) {
  // Written out, so that floats cannot tell: (z+0.5)² + 1e-9, and the same at -0.25 and 0.25.
  const std::string near = "(z^2+z+0.250000001)", next = "(z^2+0.5*z+0.062500001)", last = "(z^2-0.5*z+0.062500001)";
  expect_hits(near + "*(z-0.5)", {{1.5}}, Hits::first);
  expect_hits(near + "*(z-0.5)", {{1.5}});
  expect_hits(near + "*" + next + "*" + last + "*(z-0.5)", {{1.5}}, Hits::first);
  expect_hits(near + "*" + last, {}, Hits::first);
  // Behind it comes what stays open.
  expect_hits(near + "*(z-0.5)^2", {{1.5, HitStatus::tangent}}, Hits::first);
  // The range of the ray is kept.
  expect_hits(near + "*(z-0.5)", {}, Hits::first, 0, 1.25f);
}

// Of single precision these numbers are a hundredth off.
TEST(DecidedHits, ConstantsAndLevelsAreDoubles) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const char* compiled : {"0", "400"}) {
    expect_hits("max(z+1000000.3,x)-1000000", {{1 - (1000000.3 - 1000000)}}, Hits::all, 0, infinity, compiled);
    expect_hits("z+1000000", {{1 + (1000000.3 - 1000000)}}, Hits::all, 0, infinity, compiled, 1000000.3);
  }
}

TEST(DecidedHits, RangesCutPairs) {
  // Between the two floats 1.5 and 1.5000011920929.
  const float between = 1.50000060f;
  expect_hits("(z-0.5)*(z-0.500001)", {{1 + 0.500001}}, Hits::all, between);
  expect_hits("(z-0.5)*(z-0.500001)", {{1.5}}, Hits::all, 0, between);
}

TEST(DecidedHits, CreasesAreCrossed) {
  expect_hits("max(z-0.5,2*(z-0.5))", {{1.5}});
  expect_hits("z-0.5+0.5*abs(z-0.5)", {{1.5}});
  expect_hits("abs(z-0.5)-1e-6", {{1.5 - 1e-6}, {1.5 + 1e-6}});
  expect_hits("abs(z-0.5)+1e-8", {});
  // Where floats cannot tell on which side of the crease they are.
  expect_hits("abs(z^2-z+0.25)-1e-10", {{1.5 - 1e-5}, {1.5 + 1e-5}});
  expect_hits("max(z^2-z+0.25,-1)-1e-12", {{1.5 - 1e-6}, {1.5 + 1e-6}});
  expect_hits("max(abs(z-0.5)-1e-6,x-2)", {{1.5 - 1e-6}, {1.5 + 1e-6}});
}

TEST(DecidedHits, PolesAndEndsOfDomainsAreNone) {
  const CompileAtMost operations("0");
  for (const char* equation : {"1/(z-0.5)", "1/(z-0.5)^3+1e-3", "log(z-0.5)^2+1", "floor(z-0.5)+0.5"}) {
    for (const TestDevice& device : deciding_devices()) {
      const HitList hits =
          Interrogator(device.device, implicit(equation, domain)).cast(oblique_rays(), {.hits = Hits::all});
      EXPECT_EQ(std::ranges::count(hits.status(), HitStatus::isolated), 0) << equation << " on " << device.label;
    }
  }
}

// A sphere that rays graze at distances from far inside of the rounding of floats to outside of it.
TEST(DecidedHits, GrazedSpheres) {
  std::vector<Ray> list;
  for (int i = -24; i <= 24; i++) {
    // From the very tangent outwards and inwards, in steps of a float.
    const float y = i == 0 ? 1.0f : std::nextafter(1.0f, i > 0 ? 2.0f : 0.0f) + float(i) * 0x1p-24f;
    list.push_back({{-2, y, 0}, {1, 0, 0}});
  }
  const RayBatch rays(list);
  const CompileAtMost operations("0");
  for (const TestDevice& device : deciding_devices()) {
    const HitList hits = Interrogator(device.device, implicit("x^2+y^2+z^2-1", {glm::dvec3(-2), glm::dvec3(2), 0}))
                             .cast(rays, {.hits = Hits::all});
    for (std::size_t i = 0; i < rays.size(); i++) {
      SCOPED_TRACE(fmt::format("{}, ray {}", device.label, i));
      const double y = rays[i].origin.y, chord = 1 - y * y;
      const std::size_t begin = hits.offsets()[i], count = hits.offsets()[i + 1] - begin;
      if (y == 1) {
        ASSERT_EQ(count, 1u);
        EXPECT_EQ(hits.status()[begin], HitStatus::tangent);
        EXPECT_LE(std::abs(hits.t()[begin] - 2), hits.uncertainty()[begin]);
        continue;
      }
      ASSERT_EQ(count, y > 1 ? 0u : 2u);
      for (std::size_t k = 0; k < count; k++) {
        EXPECT_EQ(hits.status()[begin + k], HitStatus::isolated);
        const double t = 2 + (k == 0 ? -1 : 1) * std::sqrt(chord);
        EXPECT_LE(std::abs(hits.t()[begin + k] - t), hits.uncertainty()[begin + k] + 1e-12);
        EXPECT_LT(hits.uncertainty()[begin + k], std::sqrt(chord)) << "which is the other one's side";
      }
    }
  }
}

}  // namespace
}  // namespace smurf::test
