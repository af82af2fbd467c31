// Walks on level sets (expressions, grids, black boxes) on every device: where a step arrives, against circles in closed
// form; where it cannot; paths of many steps against great circles and geodesics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/smurf.hpp"

KERNELS(walk);

namespace smurf::test {
namespace {

constexpr double rounding = 0x1p-24;

Domain cube(double half) { return {glm::dvec3(-half), glm::dvec3(half)}; }

Surface sphere(double half = 1.5) { return implicit("x^2+y^2+z^2-1", cube(half)); }

struct Starts {
  std::vector<glm::vec3> points, directions;
};

// Unit vectors, and directions that are neither unit nor tangent.
Starts on_sphere(std::size_t count) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  const auto vector = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
  Starts starts;
  for (std::size_t i = 0; i < count; i++) {
    starts.points.push_back(glm::normalize(vector()));
    starts.directions.push_back(vector());
  }
  return starts;
}

// The point at a chord on the great circle from p in the direction d, and the direction there.
std::pair<glm::dvec3, glm::dvec3> on_great_circle(const glm::dvec3& p, const glm::dvec3& d, double angle) {
  const glm::dvec3 n = glm::normalize(p), t = glm::normalize(d - n * glm::dot(d, n));
  return {std::cos(angle) * n + std::sin(angle) * t, -std::sin(angle) * n + std::cos(angle) * t};
}

TEST(WalkOnSphere, NeighborsAreOnTheGreatCircleAtTheChord) {
  const Starts starts = on_sphere(999);
  for (TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, sphere());
    for (const float distance : {0.01f, 0.1f, 0.7f, 1.9f}) {
      const Neighbors next = query.neighbors(starts.points, starts.directions, distance);
      ASSERT_EQ(next.size(), starts.points.size());
      const double angle = 2 * std::asin(double(distance) / 2);
      // Where the circle is nearly as wide as the sphere, a little of the chord is a lot along it.
      const double allowed = 1e-5 * distance / std::cos(angle / 2) + 4 * rounding;
      for (std::size_t i = 0; i < next.size(); i++) {
        ASSERT_EQ(next.status[i], WalkStatus::reached) << i << " " << distance;
        const auto [location, direction] = on_great_circle(starts.points[i], starts.directions[i], angle);
        ASSERT_LE(glm::distance(glm::dvec3(next.locations[i]), location), allowed) << i << " " << distance;
        ASSERT_NEAR(next.chords[i], distance, 1e-5 * distance + 4 * rounding) << i;
        ASSERT_LE(glm::distance(glm::dvec3(next.directions[i]), direction), allowed + 1e-5) << i << " " << distance;
        ASSERT_LE(glm::distance(next.normals[i], next.locations[i]), 1e-5) << i;
      }
    }
  }
}

}  // namespace
}  // namespace smurf::test
