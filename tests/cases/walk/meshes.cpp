// Walks on meshes: over the faces of a box, where all is known in closed form; borders; every triangle's plane; against
// the reference.
#include <gtest/gtest.h>

#include <cmath>

#include "checks.hpp"
#include "harness/kernel_cover.hpp"
#include "truth/meshes.hpp"

KERNELS(walk, find_nearest);

namespace smurf::test {
namespace {

std::vector<TestDevice> devices() {
  std::vector<TestDevice> all = test_devices();
  all.push_back({"reference", "reference", 0, true, reference_device()});
  return all;
}

TEST(WalkOnMesh, GoesOverTheEdgesOfABox) {
  const Surface box = mesh_surface(box_mesh(glm::vec3(-1), glm::vec3(1), 3));
  for (TestDevice& device : devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, box);
    const std::vector<glm::vec3> points{{0.5f, 0.3f, 1}, {-0.6f, 0.25f, 1}, {0.1f, 0.2f, 1}},
        directions{{1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const Neighbors next = query.neighbors(points, directions, std::vector<float>{1, 1, 3.5f});
    EXPECT_EQ(next.status[0], WalkStatus::crease);
    EXPECT_LE(glm::distance(next.locations[0], glm::vec3(1, 0.3f, 1 - std::sqrt(0.75f))), 1e-5f);
    EXPECT_LE(glm::distance(next.directions[0], glm::vec3(0, 0, -1)), 1e-5f);
    EXPECT_EQ(next.status[1], WalkStatus::reached);
    EXPECT_LE(glm::distance(next.locations[1], glm::vec3(0.4f, 0.25f, 1)), 1e-5f);
    EXPECT_LE(glm::distance(next.directions[1], glm::vec3(1, 0, 0)), 1e-5f);
    EXPECT_EQ(next.status[2], WalkStatus::unreachable);
    // What is reached is told by its place, too.
    const auto there = query.properties_at(next.coordinates, std::uint32_t(Property::location)).location;
    for (std::size_t i = 0; i < 2; i++) EXPECT_LE(glm::distance(there[i], next.locations[i]), 1e-6f);
    // All around, in steps that pass edges of triangles and of the box.
    const Paths path = query.walk(std::vector{points[2]}, std::vector{directions[2]}, 0.27f, 100);
    ASSERT_EQ(path.status.size(), 101u);
    std::size_t creases = 0;
    for (std::size_t i = 1; i <= 100; i++) {
      const glm::vec3 q = path.locations[i];
      EXPECT_NEAR(glm::distance(q, path.locations[i - 1]), 0.27, 1e-5);
      EXPECT_NEAR(q.x, 0.1, 1e-5);
      EXPECT_NEAR(std::max(std::abs(q.y), std::abs(q.z)), 1, 1e-5);
      creases += path.status[i] == WalkStatus::crease;
    }
    EXPECT_GE(creases, 11u);  // three times around
  }
}

TEST(WalkOnMesh, EndsAtBorders) {
  const Surface cylinder = mesh_surface(cylinder_mesh(1, 2, 24, 5));
  for (TestDevice& device : devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, cylinder);
    const std::vector<glm::vec3> points{{std::cos(0.1f), std::sin(0.1f), 1.5f}}, up{{0, 0, 1}};
    const Paths path = query.walk(points, up, 0.2f, 5, {.tolerance = 0.05f});
    ASSERT_EQ(path.status.size(), 4u);
    EXPECT_EQ(path.status[2], WalkStatus::reached);
    EXPECT_EQ(path.status[3], WalkStatus::boundary);
    EXPECT_NEAR(path.locations[3].z, 2, 1e-6);
    EXPECT_NEAR(path.locations[2].z, 1.9, 1e-5);
  }
}

TEST(WalkOnMesh, StepsAreRightAndAgreeWithTheReference) {
  const Surface torus = mesh_surface(torus_mesh(2, 0.7, 60, 30));
  const Interrogator reference(reference_device(), torus);
  const WalkStarts starts = random_starts(reference, torus.bounds(), 300);
  ASSERT_GT(starts.points.size(), 200u);
  const auto normals = reference.probe(starts.points, std::uint32_t(Property::normal)).normal;
  for (const float distance : {0.1f, 0.9f}) {
    SCOPED_TRACE(distance);
    const Neighbors right = reference.neighbors(starts.points, starts.directions, distance);
    for (TestDevice& device : test_devices()) {
      SCOPED_TRACE(device.label);
      const Interrogator query(device.device, torus);
      const Neighbors next = query.neighbors(starts.points, starts.directions, distance);
      const auto nearest = reference.probe(next.locations, std::uint32_t(Property::location)).location;
      for (std::size_t i = 0; i < next.size(); i++)
        EXPECT_LE(glm::distance(nearest[i], next.locations[i]), 4 * rounding * 3) << i;
      EXPECT_EQ(expect_steps(next, starts, normals, distance, [](const glm::dvec3&) { return 0.0; }, {}), next.size());
      // Hits may be told to be on another triangle of an edge.
      EXPECT_LE(count_other(next, right, 1e-4 * distance), 2u);
    }
  }
}

}  // namespace
}  // namespace smurf::test
