// Hits of surfaces s(u, v) that floats leave open, and what double precision makes of them: random chords, of which few
// stay flagged, and rays at distances from a silhouette that floats do not tell.
//
// SMURF_TEST_DENSE=10 makes it 200,000 chords a surface.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/interrogator.hpp"

KERNELS(find_hits, count_blocks, order_rows, list_open, finish_hits);

namespace smurf::test {
namespace {

constexpr double turn = 6.283185307179586;

Surface torus() { return parametric({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {0, turn}, {0, turn}); }
Surface sphere(double radius = 1) {
  return parametric({"r*cos(u)*sin(v)", "r*sin(u)*sin(v)", "r*cos(v)"}, {0, turn}, {0, turn / 2}, {{"r", radius}});
}
Surface klein_bottle() {
  return parametric({"(3+cos(u/2)*sin(v)-sin(u/2)*sin(2*v))*cos(u)", "(3+cos(u/2)*sin(v)-sin(u/2)*sin(2*v))*sin(u)",
                     "sin(u/2)*sin(v)+cos(u/2)*sin(2*v)"},
                    {0, turn}, {0, turn});
}

const TestDevice& opencl() {
  const TestDevice* device = test_device("opencl");
  if (!device) throw std::runtime_error("no OpenCL device");
  return *device;
}

RayBatch chords(const Surface& surface, std::size_t count, unsigned seed) {
  const Bounds b = surface.bounds();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const auto place = [&] {
      return b.lower + glm::dvec3(part(random), part(random), part(random)) * (b.upper - b.lower);
    };
    const glm::dvec3 from = place(), to = place(), d = glm::normalize(to - from);
    rays.set(i, {glm::vec3(from - 3 * glm::length(b.upper - b.lower) * d), glm::vec3(d)});
  }
  return rays;
}

std::size_t count_of(const HitList& hits, std::size_t ray) { return hits.offsets()[ray + 1] - hits.offsets()[ray]; }

bool is_flagged(const HitList& hits, std::size_t ray) {
  for (std::size_t h = hits.offsets()[ray]; h < hits.offsets()[ray + 1]; h++) {
    if (hits.status()[h] != HitStatus::isolated) return true;
  }
  return false;
}

void expect_few_flags(const Surface& surface, bool is_closed, const std::string& name) {
  const RayBatch rays = chords(surface, 20'000 * std::size_t(density()), 7);
  const HitList hits = Interrogator(opencl().device, surface).cast(rays, {.hits = Hits::all});
  const HitList firsts = Interrogator(opencl().device, surface).cast(rays, {.hits = Hits::first});
  const HitList truth = Interrogator(reference_device(), surface).cast(rays, {.hits = Hits::all});
  std::size_t flagged = 0, other = 0, odd = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const std::size_t count = count_of(hits, i);
    EXPECT_EQ(count_of(firsts, i), std::min<std::size_t>(count, 1)) << name << ", ray " << i;
    if (count > 0 && count_of(firsts, i) > 0) {
      const std::size_t a = hits.offsets()[i], b = firsts.offsets()[i];
      EXPECT_NEAR(hits.t()[a], firsts.t()[b], hits.uncertainty()[a] + firsts.uncertainty()[b]) << name << ", ray " << i;
    }
    if (is_flagged(hits, i)) {
      flagged++;
      continue;
    }
    odd += count % 2;
    if (is_flagged(truth, i) || count == count_of(truth, i)) continue;
    ADD_FAILURE() << name << ", ray " << i << ": " << count << " hits, " << count_of(truth, i) << " in truth";
    other++;
  }
  std::cout << fmt::format("{}: {} of {} rays flagged, {} with another count, {} odd\n", name, flagged, rays.size(),
                           other, odd);
  EXPECT_LT(double(flagged), 1e-4 * double(rays.size())) << name;
  if (is_closed) {
    EXPECT_EQ(odd, 0u) << name;
  }
}

TEST(DecidedParametricHits, FewOfRandomChordsStayFlagged) {
  expect_few_flags(torus(), true, "torus");
  expect_few_flags(sphere(), true, "sphere");
  expect_few_flags(klein_bottle(), true, "Klein bottle");
}

TEST(DecidedParametricHits, FewOfTheTeapotStayFlagged) {
  if (!has_shared_data("patches")) GTEST_SKIP();
  expect_few_flags(load_nurbs(shared_data("patches/teapot.bpt")), false, "teapot");
}

// Rays that pass a sphere at distances from 1e-3 down to what rounded rays leave of 0: pairs of hits, or none.
TEST(DecidedParametricHits, GrazedSpheres) {
  using Long = long double;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> part(-1, 1);
  const auto place = [&] { return glm::normalize(glm::dvec3(part(random), part(random), part(random))); };
  std::vector<Ray> list;
  for (int i = 0; i < 4000; i++) {
    const glm::dvec3 normal = place(), along = glm::normalize(glm::cross(normal, place()));
    const double off = part(random) * std::pow(10, -3 - 0.5 * (i % 12));
    list.push_back({glm::vec3((1 + off) * normal - 3.0 * along), glm::vec3(along)});
  }
  const RayBatch rays(list);
  const Interrogator query(opencl().device, sphere());
  const HitList all = query.cast(rays, {.hits = Hits::all}), first = query.cast(rays, {.hits = Hits::first});
  double nearest = 1;
  for (std::size_t i = 0; i < rays.size(); i++) {
    const glm::vec<3, Long> o(list[i].origin), d(list[i].direction);
    const Long a = glm::dot(d, d), b = glm::dot(o, d), square = b * b - a * (glm::dot(o, o) - 1);
    // Twice the distance from the silhouette; what is less than double rounding is not told.
    if (std::abs(square) < 1e-12) continue;
    nearest = std::min(nearest, double(std::abs(square)));
    const std::string what = fmt::format("ray {}, {:g}", i, double(square));
    ASSERT_EQ(count_of(all, i), square > 0 ? 2u : 0u) << what;
    ASSERT_EQ(count_of(first, i), square > 0 ? 1u : 0u) << what;
    for (std::size_t n = 0; n < count_of(all, i); n++) {
      const std::size_t h = all.offsets()[i] + n;
      EXPECT_EQ(all.status()[h], HitStatus::isolated) << what;
      const Long t = (-b + (n == 0 ? -1 : 1) * std::sqrt(square)) / a;
      EXPECT_LE(std::abs(Long(all.t()[h]) - t), Long(all.uncertainty()[h]) + 1e-12L) << what;
      // Coordinates are those of the place.
      const SurfaceCoordinates& c = all.coordinates()[h];
      const glm::dvec3 there{std::cos(c.u) * std::sin(c.v), std::sin(c.u) * std::sin(c.v), std::cos(c.v)};
      EXPECT_LT(glm::distance(there, glm::dvec3(all.locations()[h])), 2e-6) << what;
    }
    if (square > 0) {
      EXPECT_NEAR(first.t()[first.offsets()[i]], all.t()[all.offsets()[i]], 2e-6) << what;
    }
  }
  std::cout << fmt::format("nearest: {:g}\n", nearest);
  EXPECT_LT(nearest, 1e-9);
}

TEST(DecidedParametricHits, TangentsAreOneRow) {
  const RayBatch rays(
      std::vector<Ray>{{{-2, 1, 0}, {1, 0, 0}}, {{1, -2, 0}, {0, 1, 0}}, {{-1.5f, -2, 1}, {0.75f, 1, 0}}});
  const HitList hits = Interrogator(opencl().device, sphere()).cast(rays, {.hits = Hits::all});
  for (std::size_t i = 0; i < rays.size(); i++) {
    ASSERT_EQ(count_of(hits, i), 1u) << i;
    EXPECT_EQ(hits.status()[i], HitStatus::tangent);
    EXPECT_NEAR(hits.t()[i], 2, hits.uncertainty()[i]);
    EXPECT_LT(hits.uncertainty()[i], 1e-6f);
  }
}

TEST(DecidedParametricHits, StretchesAreOneRow) {
  const Surface tube = parametric({"cos(u)", "sin(u)", "v"}, {0, turn}, {0, 1});
  const RayBatch rays(std::vector<Ray>{{{0, 1, -2}, {0, 0, 1}}, {{1, 0, -2}, {0, 0, 1}}});
  const HitList hits = Interrogator(opencl().device, tube).cast(rays, {.hits = Hits::all});
  for (std::size_t i = 0; i < rays.size(); i++) {
    ASSERT_EQ(count_of(hits, i), 1u) << i;
    EXPECT_EQ(hits.status()[i], HitStatus::unresolved);
    EXPECT_NEAR(hits.t()[i], 2.5, 1e-5);
    EXPECT_NEAR(hits.uncertainty()[i], 0.5, 1e-5);
  }
}

}  // namespace
}  // namespace smurf::test
