// Distances of points from surfaces, and whether points are inside, on every executor and the reference: against closed
// forms (spheres of every kind, a torus, two spheres, a cylinder that ends at the border of its domain), of a mesh
// against brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "cases/interrogation/surfaces.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/refusal.hpp"
#include "smurf/interrogator.hpp"

KERNELS(find_hits, count_flagged, measure, find_nearest);

namespace smurf::test {
namespace {

constexpr auto distance_and_inside = Property::distance | Property::inside;

std::vector<glm::vec3> random_points(const glm::vec3& reach, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> part(-1, 1);
  std::vector<glm::vec3> points(count);
  for (glm::vec3& p : points) p = reach * glm::vec3(part(random), part(random), part(random));
  return points;
}

// Distances on all executors against the truth; returns the greatest error.
double expect_distances(const Surface& surface, const std::vector<glm::vec3>& points,
                        const std::function<double(const glm::dvec3&)>& truth, double allowed,
                        const std::string& what) {
  double greatest = 0;
  for (TestDevice& device : one_of_each()) {
    const PointProperties found = Interrogator(device.device, surface).probe(points, std::uint32_t(Property::distance));
    double worst = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      const double error = std::abs(double(found.distance[i]) - truth(glm::dvec3(points[i])));
      if (!(error <= worst)) worst = error, at = i;
    }
    EXPECT_LE(worst, allowed) << what << " on " << device.label << ", at " << points[at].x << ", " << points[at].y
                              << ", " << points[at].z << ": " << found.distance[at];
    greatest = std::max(greatest, worst);
  }
  std::cout << what << ": distances are off by " << greatest << " at most\n";
  return greatest;
}

// How far the surfaces themselves are from a sphere.
double off_sphere(const std::string& kind) {
  if (kind == "mesh") return 3e-3;  // chords of arcs of 1/32 of a right angle, about
  if (kind == "grid") return 5e-4;  // the border of a grid spoils the quadratic, which B-splines reproduce inside
  return 2e-6;
}

TEST(Distance, SpheresOfEveryKind) {
  std::vector<glm::vec3> points = random_points(glm::vec3(1.5f), 100, 7);
  points.emplace_back(0.0f, 0.0f, 0.0f);  // the middle, as far from all
  points.emplace_back(1.0f, 0.0f, 0.0f);
  points.emplace_back(7.0f, -4.0f, 4.0f);
  for (const auto& [name, surface] : spheres())
    expect_distances(
        surface, points, [](const glm::dvec3& p) { return std::abs(glm::length(p) - 1); }, off_sphere(name),
        "sphere, " + name);
}

TEST(Distance, Torus) {
  const auto truth = [](const glm::dvec3& p) { return std::abs(std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.4); };
  const std::vector<glm::vec3> points = random_points(glm::vec3(2, 2, 1), 150, 8);
  const double pi = std::numbers::pi;
  expect_distances(implicit("(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)", {glm::dvec3(-1.6), glm::dvec3(1.6)}), points, truth,
                   4e-6, "torus by an equation");
  expect_distances(
      parametric({"(1+0.4*cos(v))*cos(u)", "(1+0.4*cos(v))*sin(u)", "0.4*sin(v)"}, {0, 2 * pi}, {0, 2 * pi}), points,
      truth, 4e-6, "torus by u and v");
  const auto density = [](double x, double y, double z) { return 0.4 - std::hypot(std::hypot(x, y) - 1, z); };
  for (const Reconstruction reconstruction : {Reconstruction::trilinear, Reconstruction::tricubic}) {
    const bool linear = reconstruction == Reconstruction::trilinear;
    // The chord of a cell across the small circle is 2e-3 off.
    expect_distances(isosurface(sampled(49, 1.6, density), 0.0, {.reconstruction = reconstruction}), points, truth,
                     linear ? 3e-3 : 5e-4, linear ? "torus, trilinear" : "torus, tricubic");
  }
}

// Points between two spheres, next to where both are equally far: a search that only went downhill from one place would
// end at either.
TEST(Distance, NearestOfTwoSpheres) {
  const Surface surface = implicit("((x-1)^2+y^2+z^2-0.25)*((x+1)^2+y^2+z^2-0.16)", {glm::dvec3(-2), glm::dvec3(2)});
  expect_distances(
      surface, random_points(glm::vec3(0.3f, 2, 2), 120, 9),
      [](const glm::dvec3& p) {
        return std::min(std::abs(glm::length(p - glm::dvec3(1, 0, 0)) - 0.5),
                        std::abs(glm::length(p + glm::dvec3(1, 0, 0)) - 0.4));
      },
      4e-6, "two spheres");
}

// The nearest point is on the rim, where the domain ends.
TEST(Distance, BorderOfTheDomain) {
  const Surface surface = implicit("x^2+y^2-1", {glm::dvec3(-1.5, -1.5, -1), glm::dvec3(1.5, 1.5, 1)});
  std::vector<glm::vec3> points = random_points(glm::vec3(2, 2, 1), 100, 10);
  for (std::size_t i = 0; i < points.size(); i++) points[i].z += i % 2 == 0 ? 2.0f : -2.0f;
  expect_distances(
      surface, points, [](const glm::dvec3& p) { return std::hypot(std::hypot(p.x, p.y) - 1, std::abs(p.z) - 1); },
      2e-4, "rim");
}

TEST(Distance, MeshByBruteForce) {
  const Mesh mesh = torus_mesh(1, 0.4, 24, 12);
  const std::vector<glm::vec3> points = random_points(glm::vec3(2, 2, 1), 100, 11);
  // Subdivided triangles: the nearest of many points of each, then again around it.
  const auto to_triangle = [](const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    glm::dvec2 best(1.0 / 3);
    double least = std::numeric_limits<double>::infinity(), width = 1;
    for (int round = 0; round < 24; round++, width *= 0.5) {
      const glm::dvec2 middle = best;
      for (int i = -2; i <= 2; i++) {
        for (int j = -2; j <= 2; j++) {
          glm::dvec2 uv = glm::clamp(middle + 0.5 * width * glm::dvec2(i, j), 0.0, 1.0);
          if (uv.x + uv.y > 1) uv /= uv.x + uv.y;
          const double distance = glm::distance(p, (1 - uv.x - uv.y) * a + uv.x * b + uv.y * c);
          if (distance < least) least = distance, best = uv;
        }
      }
    }
    return least;
  };
  expect_distances(
      mesh_surface(mesh), points,
      [&](const glm::dvec3& p) {
        double least = std::numeric_limits<double>::infinity();
        for (const glm::uvec3& face : mesh.faces()) {
          const glm::dvec3 a(mesh.vertices()[face.x]), b(mesh.vertices()[face.y]), c(mesh.vertices()[face.z]);
          least = std::min(least, to_triangle(p, a, b, c));
        }
        return least;
      },
      2e-6, "torus of triangles");
}

TEST(Inside, SpheresOfEveryKind) {
  std::vector<glm::vec3> points;
  for (const glm::vec3& p : random_points(glm::vec3(1.5f), 1000, 12)) {
    if (std::abs(glm::length(p) - 1) > 5e-3f) points.push_back(p);
  }
  for (const auto& [name, surface] : spheres()) {
    for (TestDevice& device : one_of_each()) {
      const Interrogator query(device.device, surface);
      if (name == "parametric") {
        refusal(ErrorCode::usage, [&] { query.probe(points, std::uint32_t(Property::inside)); });
        continue;
      }
      const PointProperties found = query.probe(points, distance_and_inside);
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < points.size(); i++)
        wrong += found.inside[i] == (glm::length(points[i]) < 1 ? 1.0f : 0.0f) ? 0 : 1;
      EXPECT_EQ(wrong, 0u) << name << " on " << device.label;
    }
  }
}

TEST(Inside, SidesOfLevelsAndMeshes) {
  const std::vector<glm::vec3> points{glm::vec3(0), glm::vec3(1.2f, 0, 0), glm::vec3(9, 9, 9),
                                      glm::vec3(std::numeric_limits<float>::quiet_NaN())};
  const Domain box{glm::dvec3(-1.5), glm::dvec3(1.5)};
  for (TestDevice& device : one_of_each()) {
    // Inside of an isosurface is the denser side, of an equation the smaller one.
    const PointProperties dense =
        Interrogator(device.device, isosurface("x^2+y^2+z^2", 1, box)).probe(points, std::uint32_t(Property::inside));
    EXPECT_EQ(dense.inside[0], 0.0f) << device.label;
    EXPECT_EQ(dense.inside[1], 1.0f) << device.label;
    EXPECT_TRUE(std::isnan(dense.inside[2]) && std::isnan(dense.inside[3])) << device.label;
    const Interrogator mesh(device.device, mesh_surface(torus_mesh(1, 0.4, 48, 24)));
    const PointProperties torus = mesh.probe(points, distance_and_inside);
    EXPECT_EQ(torus.inside[0], 0.0f) << device.label;
    EXPECT_EQ(torus.inside[1], 1.0f) << device.label;
    EXPECT_EQ(torus.inside[2], 0.0f) << device.label;
    EXPECT_TRUE(std::isnan(torus.inside[3]) && std::isnan(torus.distance[3])) << device.label;
    // No surface at all.
    const Interrogator none(device.device, implicit("x^2+y^2+z^2+1", box));
    EXPECT_FALSE(std::isfinite(none.probe(points, std::uint32_t(Property::distance)).distance[0])) << device.label;
  }
}

TEST(Inside, RefusesOpenMeshesAndHits) {
  for (TestDevice& device : one_of_each()) {
    const Interrogator open(device.device, mesh_surface(cylinder_mesh(1, 2, 20, 4)));
    const std::vector<glm::vec3> points{glm::vec3(0)};
    const std::string message = refusal(ErrorCode::usage, [&] { open.probe(points, std::uint32_t(Property::inside)); });
    EXPECT_NE(message.find("open"), std::string::npos) << message;
    RayBatch rays(1);
    refusal(ErrorCode::usage, [&] { open.cast(rays, {.properties = std::uint32_t(Property::distance)}); });
    EXPECT_NEAR(open.probe(points, std::uint32_t(Property::distance)).distance[0], 1, 0.02) << device.label;
  }
}

}  // namespace
}  // namespace smurf::test
