// Stream surfaces by the back-stream method on every device, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"

namespace smurf::test {

KERNELS(trace_curtain, find_hits, measure);

namespace {

using glm::dvec3;

constexpr double pitch = 0.3, least_u = 0.2, greatest_u = 1.2, time = 6;
constexpr int places = 20000;  // on a ray, among which roots are told apart

// Of v = (-y, x, 0.3) with the seed (u, 0, 0): u and τ of a point, and how far off the surface it is.
dvec3 helicoid(const dvec3& p) {
  const double tau = p.z / pitch, c = std::cos(tau), s = std::sin(tau);
  return {p.x * c + p.y * s, tau, p.y * c - p.x * s};
}

std::size_t roots_of(const dvec3& o, const dvec3& d, double length) {
  std::size_t count = 0;
  dvec3 before = helicoid(o);
  for (int i = 1; i <= places; i++) {
    const dvec3 here = helicoid(o + d * (length * i / places));
    const double part = before.z / (before.z - here.z);
    const double u = std::lerp(before.x, here.x, part), tau = std::lerp(before.y, here.y, part);
    count += before.z * here.z <= 0 && u >= least_u && u <= greatest_u && tau >= 0 && tau <= time;
    before = here;
  }
  return count;
}

TEST(BackStream, FindsAllHitsOnAHelicoid) {
  const VectorField field = expression_flow({"-y", "x", "0.3"}, {.lower = dvec3(-3), .upper = dvec3(3)});
  const Surface surface = stream_surface(field, seed_expression({"u", "0", "0"}, {least_u, greatest_u}),
                                         {.time = {0, time}, .method = StreamMethod::back_stream});
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> even(-1, 1);
  std::vector<Ray> rays;
  std::size_t known = 0;
  for (int i = 0; i < 500; i++) {
    const dvec3 from = 4.0 * glm::normalize(dvec3(normal(random), normal(random), normal(random)));
    const dvec3 to = dvec3(0, 0, 0.9) + dvec3(1.2, 1.2, 0.9) * dvec3(even(random), even(random), even(random));
    Ray ray;
    ray.origin = glm::vec3(from);
    ray.direction = glm::vec3(glm::normalize(to - from));
    rays.push_back(ray);
    known += roots_of(dvec3(ray.origin), dvec3(ray.direction), 8);
  }
  ASSERT_GT(known, 100u);
  for (const TestDevice& device : test_devices()) {
    const HitList hits = Interrogator(device.device, surface).cast(RayBatch(rays), {.hits = Hits::all});
    EXPECT_EQ(hits.size(), known) << device.label;
    for (std::size_t i = 0; i < hits.size(); i++) {
      // Within the default tolerance, 1e-5 of the extent of 6, along the surface's normal.
      const dvec3 at = helicoid(dvec3(hits.locations()[i]));
      EXPECT_NEAR(at.z, 0, 6e-5) << device.label;
      EXPECT_NEAR(hits.coordinates()[i].u, at.x, 2e-4) << device.label;
      EXPECT_NEAR(hits.coordinates()[i].v, at.y, 1e-3) << device.label;
    }
  }
}

}  // namespace
}  // namespace smurf::test
