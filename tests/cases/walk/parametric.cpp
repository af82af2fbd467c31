// Walks on surfaces made of pieces (parametric, NURBS, stream surfaces with a mesh) on every device: against closed
// forms and the reference; over seams, knots, poles and ends.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/smurf.hpp"

KERNELS(walk, find_nearest);

namespace smurf::test {
namespace {

using glm::dvec3;

constexpr double pi = std::numbers::pi;
// A chord of 1 in a surface of this size is told to about 1e-5; coordinates are floats of up to 2π.
constexpr double rounding = 3e-6;

Surface sphere() { return parametric({"cos(v)*cos(u)", "cos(v)*sin(u)", "sin(v)"}, {0, 2 * pi}, {-pi / 2, pi / 2}); }
Surface torus() { return parametric({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {0, 2 * pi}, {0, 2 * pi}); }
Surface nurbs_torus() { return load_nurbs(SMURF_SOURCE_DIR "/host/examples/nurbs-torus.json"); }
VectorField screw() { return expression_flow({"-y", "x", "0.3"}, {.lower = glm::dvec3(-3), .upper = glm::dvec3(3)}); }
Surface helicoid() { return stream_surface(screw(), seed_expression({"u", "0", "0"}, {0.2, 1.2}), {.time = {0, 6}}); }

// Kernels of pieces take drivers long.
std::vector<TestDevice>& few() {
  static std::vector<TestDevice> devices = one_of_each();
  return devices;
}

struct Starts {
  std::vector<glm::vec3> points, directions;
  std::size_t size() const { return points.size(); }
  void add(const dvec3& p, const dvec3& d) {
    points.emplace_back(p);
    directions.emplace_back(d);
  }
};

template <class Place>
Starts random_starts(std::size_t count, const Place& place) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0.02, 0.98);
  Starts starts;
  for (std::size_t i = 0; i < count; i++) {
    const double u = part(random), v = part(random);
    starts.add(place(u, v), dvec3(normal(random), normal(random), normal(random)));
  }
  return starts;
}

TEST(WalkOnPieces, NeighborsOnASphereAreOnGreatCircles) {
  Starts starts = random_starts(300, [](double u, double v) {
    const double z = 2 * v - 1, rho = std::sqrt(1 - z * z);
    return dvec3(rho * std::cos(2 * pi * u), rho * std::sin(2 * pi * u), z);
  });
  // Along meridians and through the poles, from a pole, along the seam and across it.
  for (const double u : {0.0, 0.4, 1.7, pi, 5.9}) {
    const dvec3 out(std::cos(u), std::sin(u), 0);
    starts.add(0.6 * out + dvec3(0, 0, 0.8), 0.6 * dvec3(0, 0, 1) - 0.8 * out);
    starts.add(0.6 * out - dvec3(0, 0, 0.8), dvec3(0, 0, -1));
    starts.add(dvec3(0, 0, 1), out);
  }
  starts.add(dvec3(1, 0, 0), dvec3(0, 0, 1));
  starts.add(dvec3(1, 0, 0), dvec3(0, -1, 0));
  starts.add(dvec3(std::cos(0.1), std::sin(0.1), 0), dvec3(0, -1, 0.3));
  for (TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, sphere());
    for (const float distance : {0.02f, 0.5f, 1.8f}) {
      const Neighbors next = query.neighbors(starts.points, starts.directions, distance);
      ASSERT_EQ(next.size(), starts.size());
      ASSERT_EQ(next.coordinates.size(), starts.size());
      const double angle = 2 * std::asin(double(distance) / 2);
      const double allowed = rounding / std::cos(angle / 2);
      for (std::size_t i = 0; i < next.size(); i++) {
        ASSERT_EQ(next.status[i], WalkStatus::reached) << i << " " << distance << " " << name_of(next.status[i]);
        const dvec3 n = glm::normalize(dvec3(starts.points[i])), any(starts.directions[i]);
        const dvec3 d = glm::normalize(any - n * glm::dot(n, any));
        // What rounds the normal turns the plane about the start.
        ASSERT_LE(glm::distance(dvec3(next.locations[i]), std::cos(angle) * n + std::sin(angle) * d), allowed)
            << i << " " << distance;
        ASSERT_NEAR(next.chords[i], distance, rounding) << i;
        ASSERT_LE(glm::distance(next.normals[i], next.locations[i]), 1e-4) << i;
      }
      const auto there = query.properties_at(next.coordinates, Property::location | Property::normal);
      for (std::size_t i = 0; i < next.size(); i++)
        ASSERT_LE(glm::distance(there.location[i], next.locations[i]), 1e-6) << i;
    }
    const Neighbors beyond = query.neighbors(starts.points, starts.directions, 2.01f);
    for (std::size_t i = 0; i < beyond.size(); i++) {
      ASSERT_EQ(beyond.status[i], WalkStatus::unreachable) << i << " " << name_of(beyond.status[i]);
      ASSERT_LE(glm::distance(beyond.locations[i], starts.points[i]), rounding) << i;
      ASSERT_EQ(beyond.chords[i], 0) << i;
    }
  }
}

// On any device as the reference says. A start that is close to where a status changes may say another.
void expect_as_reference(const Surface& surface, const Starts& starts, const std::vector<float>& distances,
                         double allowed, std::size_t others) {
  const Interrogator reference(reference_device(), surface);
  std::vector<Neighbors> truth;
  for (const float distance : distances)
    truth.push_back(reference.neighbors(starts.points, starts.directions, distance));
  for (TestDevice& device : few()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, surface);
    std::size_t different = 0;
    for (std::size_t k = 0; k < distances.size(); k++) {
      const Neighbors next = query.neighbors(starts.points, starts.directions, distances[k]);
      for (std::size_t i = 0; i < next.size(); i++) {
        if (next.status[i] != truth[k].status[i]) {
          different++;
          std::cerr << "  " << device.label << ": start " << i << " at " << distances[k] << ": "
                    << name_of(next.status[i]) << ", reference " << name_of(truth[k].status[i]) << "\n";
          continue;
        }
        // The end of a curve that runs along a border is where it touches that.
        const double wide = next.status[i] == WalkStatus::boundary ? 20 : 1;
        EXPECT_LE(glm::distance(next.locations[i], truth[k].locations[i]), wide * allowed)
            << i << " at " << distances[k] << ", " << name_of(next.status[i]);
      }
    }
    EXPECT_LE(different, others);
  }
}

TEST(WalkOnPieces, ToriAgreeWithTheReference) {
  const Starts starts = random_starts(150, [](double u, double v) {
    return dvec3((2 + std::cos(2 * pi * v)) * std::cos(2 * pi * u), (2 + std::cos(2 * pi * v)) * std::sin(2 * pi * u),
                 std::sin(2 * pi * v));
  });
  expect_as_reference(torus(), starts, {0.1f, 0.9f, 1.9f}, 5e-5, 4);
  expect_as_reference(nurbs_torus(), starts, {0.1f, 0.9f, 1.9f}, 5e-5, 4);
}

TEST(WalkOnPieces, SaddlesEndAtTheirBorders) {
  const auto place = [](double u, double v) {
    const double x = 4 * u - 2, y = 4 * v - 2;
    return dvec3(x, y, 0.4 * x * y * y);
  };
  expect_as_reference(parametric({"u", "v", "0.4*u*v^2"}, {-2, 2}, {-2, 2}), random_starts(150, place),
                      {0.2f, 1.0f, 2.5f}, 5e-5, 3);
}

TEST(WalkOnPieces, PathsOfManyStepsStayOnCircles) {
  for (TestDevice& device : few()) {
    SCOPED_TRACE(device.label);
    for (const Surface& surface : {torus(), nurbs_torus()}) {
      const Interrogator query(device.device, surface);
      // The outer equator 10 times around, and a small circle.
      const std::vector<glm::vec3> points{{3, 0, 0}, {3, 0, 0}}, directions{{0, 1, 0}, {0, 0, 1}};
      for (const int which : {0, 1}) {
        const double radius = which == 0 ? 3 : 1;
        constexpr std::uint32_t steps = 400;
        const auto r = float(2 * radius * std::sin(pi / 40));
        const Paths paths = query.walk(std::span(points).subspan(std::size_t(which), 1),
                                       std::span(directions).subspan(std::size_t(which), 1), r, steps);
        ASSERT_EQ(paths.locations.size(), steps + 1);
        const dvec3 centre = which == 0 ? dvec3(0) : dvec3(2, 0, 0);
        for (std::size_t i = 0; i <= steps; i++) {
          const dvec3 q = dvec3(paths.locations[i]) - centre;
          EXPECT_NEAR(glm::length(q), radius, 1e-4);
          EXPECT_NEAR(which == 0 ? q.z : q.y, 0, 2e-4) << i;
        }
        EXPECT_LE(glm::distance(dvec3(paths.locations[steps]), centre + dvec3(radius, 0, 0)), 2e-3 * radius);
      }
    }
  }
}

TEST(WalkOnPieces, StreamSurfaces) {
  for (TestDevice& device : few()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, helicoid());
    // Rulings are straight, and end at the rims.
    Starts starts;
    for (const double t : {0.5, 1.0, 3.3, 5.0}) {
      const dvec3 out(std::cos(t), std::sin(t), 0);
      starts.add(0.5 * out + dvec3(0, 0, 0.3 * t), out);
    }
    const Neighbors next = query.neighbors(starts.points, starts.directions, 0.4f);
    const Neighbors rim = query.neighbors(starts.points, starts.directions, 0.8f);
    for (std::size_t i = 0; i < starts.size(); i++) {
      const dvec3 p(starts.points[i]), d(starts.directions[i]);
      ASSERT_EQ(next.status[i], WalkStatus::reached) << name_of(next.status[i]);
      EXPECT_LE(glm::distance(dvec3(next.locations[i]), p + 0.4 * d), 1e-4);
      EXPECT_NEAR(next.coordinates[i].u, 0.9, 1e-4);
      ASSERT_EQ(rim.status[i], WalkStatus::boundary) << name_of(rim.status[i]);
      EXPECT_LE(glm::distance(dvec3(rim.locations[i]), p + 0.7 * d), 1e-4);
    }
  }
  expect_as_reference(helicoid(),
                      random_starts(24,
                                    [](double u, double v) {
                                      const double t = 6 * v, r = 0.2 + u;
                                      return dvec3(r * std::cos(t), r * std::sin(t), 0.3 * t);
                                    }),
                      {0.3f, 1.0f}, 3e-4, 2);
}

TEST(WalkOnPieces, ClosedStreamSurfacesGoOn) {
  const Surface ring =
      stream_surface(expression_flow({"-y", "x", "0"}, {.lower = glm::dvec3(-3), .upper = glm::dvec3(3)}),
                     seed_expression({"1", "0", "u"}, {-1, 1}), {.time = {0, 2 * pi}});
  for (TestDevice& device : few()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, ring);
    const std::vector<glm::vec3> points{{0, -1, 0.2f}}, directions{{1, 0, 0}};
    const Neighbors next = query.neighbors(points, directions, float(2 * std::sin(pi / 3)));
    ASSERT_EQ(next.status[0], WalkStatus::reached) << name_of(next.status[0]);
    EXPECT_LE(glm::distance(dvec3(next.locations[0]), dvec3(std::cos(pi / 6), 0.5, 0.2)), 2e-4);
  }
}

// The side z = 1 of a box meets others at right angles.
TEST(WalkOnPieces, CreasesBetweenPatchesAreSaid) {
  const auto plane = [](const dvec3& o, const dvec3& a, const dvec3& b) {
    Patch p;
    p.degree = {1, 1};
    p.size = {2, 2};
    p.knots = {std::vector<double>{0, 0, 1, 1}, std::vector<double>{0, 0, 1, 1}};
    for (const dvec3& q : {o, o + a, o + b, o + a + b}) p.points.emplace_back(q, 1.0);
    return p;
  };
  const Surface corner = nurbs({plane({0, 0, 1}, {1, 0, 0}, {0, 1, 0}), plane({1, 0, 0}, {0, 1, 0}, {0, 0, 1})});
  for (TestDevice& device : few()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, corner);
    const std::vector<glm::vec3> points{{0.6f, 0.5f, 1}, {0.6f, 0.5f, 1}, {0.6f, 0.5f, 1}},
        directions{{1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<float> distances{0.3f, 0.5f, 0.7f};
    const Neighbors next = query.neighbors(points, directions, distances);
    EXPECT_EQ(next.status[0], WalkStatus::reached) << name_of(next.status[0]);
    EXPECT_LE(glm::distance(next.locations[0], glm::vec3(0.9f, 0.5f, 1)), 1e-6);
    EXPECT_EQ(next.status[1], WalkStatus::crease) << name_of(next.status[1]);
    EXPECT_LE(glm::distance(next.locations[1], glm::vec3(1, 0.5f, 0.7f)), 1e-5);
    EXPECT_EQ(next.status[2], WalkStatus::boundary) << name_of(next.status[2]);
    EXPECT_LE(glm::distance(next.locations[2], glm::vec3(0.6f, 1, 1)), 1e-6);
  }
}

}  // namespace
}  // namespace smurf::test
