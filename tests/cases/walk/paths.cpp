// Paths of 1,000 steps on every device, against exact curves: great circles of a sphere; helices of a cylinder; the
// outer equator and a meridian of a torus. By symmetry steps of one length on these are all alike, and so the rows of a
// path are points of the curve at even angles. How far they drift is stated: in parts of the radius, after 1,000 steps.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "checks.hpp"
#include "harness/kernel_cover.hpp"

KERNELS(walk);

namespace smurf::test {
namespace {

constexpr std::uint32_t steps = 1000;

struct Curve {
  std::string name;
  glm::vec3 point, direction;
  float distance;
  std::function<glm::dvec3(int step)> at;
};

// Every point within `across` of the curve, and within `along` of where it is after so many steps.
void expect_path(const Interrogator& query, const std::string& device, const Curve& curve, double drift) {
  SCOPED_TRACE(curve.name);
  const Paths paths = query.walk(std::vector{curve.point}, std::vector{curve.direction}, curve.distance, steps);
  ASSERT_EQ(paths.size(), 1u);
  ASSERT_EQ(paths.status.size(), steps + 1);
  double farthest = 0, chord = 0;
  for (std::uint32_t i = 0; i <= steps; i++) {
    ASSERT_EQ(paths.steps[i], i);
    ASSERT_EQ(paths.status[i], i == 0 ? WalkStatus::start : WalkStatus::reached);
    farthest = std::max(farthest, glm::distance(glm::dvec3(paths.locations[i]), curve.at(int(i))));
    if (i > 0)
      chord =
          std::max(chord, std::abs(glm::distance(glm::dvec3(paths.locations[i]), glm::dvec3(paths.locations[i - 1])) -
                                   double(curve.distance)));
  }
  EXPECT_LE(farthest, drift);
  EXPECT_LE(chord, 1e-5 * curve.distance + 4 * rounding * 3);
  testing::Test::RecordProperty("drift on the " + curve.name + ", " + device, fmt::format("{:.2e}", farthest));
}

// The angle and the rise of a step on the cylinder of radius 1 about z, at an angle to the horizontal: the point at the
// chord r of the ellipse in which the plane of (1, 0, 0) and (0, cos, sin) cuts the cylinder.
std::pair<double, double> helix_step(double slope, double r) {
  const auto excess = [&](double angle) {
    return 2 - 2 * std::cos(angle) + std::pow(std::tan(slope) * std::sin(angle), 2) - r * r;
  };
  double low = 0, high = 0.5 * std::numbers::pi;
  for (int i = 0; i < 100; i++) (excess(0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
  return {low, std::tan(slope) * std::sin(low)};
}

std::vector<TestDevice> devices() {
  std::vector<TestDevice> all = test_devices();
  all.push_back({"reference", "reference", 0, true, reference_device()});
  return all;
}

// Roundings of a step, 1e-7, turn the way by their part of its length: over 1,000 steps that adds up to less than this.
constexpr double stated_drift = 5e-4;

TEST(PathsOfAThousandSteps, FollowGreatCirclesOfASphere) {
  const double r = 0.05, angle = 2 * std::asin(r / 2);
  const glm::dvec3 n = glm::normalize(glm::dvec3(1, 2, 2)), t = glm::normalize(glm::cross(n, glm::dvec3(0.3, 0, 1)));
  for (TestDevice& device : devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, implicit("x^2+y^2+z^2-1", {glm::dvec3(-1.5), glm::dvec3(1.5)}));
    expect_path(query, device.label,
                {"great circle", glm::vec3(n), glm::vec3(t), float(r),
                 [&](int i) { return std::cos(angle * i) * n + std::sin(angle * i) * t; }},
                stated_drift);
  }
}

TEST(PathsOfAThousandSteps, FollowHelicesOfACylinder) {
  const float r = 0.05f;
  const double slope = 0.4;
  const auto [angle, rise] = helix_step(slope, double(r));
  for (TestDevice& device : one_of_each()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device,
                             implicit("x^2+y^2-1", {glm::dvec3(-1.5, -1.5, -1), glm::dvec3(1.5, 1.5, 25)}));
    expect_path(query, device.label,
                {"helix",
                 {1, 0, 0},
                 glm::vec3(0, std::cos(slope), std::sin(slope)),
                 r,
                 [&](int i) { return glm::dvec3(std::cos(angle * i), std::sin(angle * i), rise * i); }},
                stated_drift);
  }
}

TEST(PathsOfAThousandSteps, FollowCirclesOfATorus) {
  const float r = 0.05f;
  const auto turn = [&](double radius) { return 2 * std::asin(double(r) / (2 * radius)); };
  for (TestDevice& device : one_of_each()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device,
                             implicit("(sqrt(x^2+y^2)-2)^2+z^2-0.25", {glm::dvec3(-3, -3, -1), glm::dvec3(3, 3, 1)}));
    expect_path(query, device.label,
                {"outer equator",
                 {2.5f, 0, 0},
                 {0, 1, 0},
                 r,
                 [&](int i) { return 2.5 * glm::dvec3(std::cos(turn(2.5) * i), std::sin(turn(2.5) * i), 0); }},
                stated_drift);
    expect_path(
        query, device.label,
        {"meridian",
         {2.5f, 0, 0},
         {0, 0, 1},
         r,
         [&](int i) { return glm::dvec3(2 + 0.5 * std::cos(turn(0.5) * i), 0, 0.5 * std::sin(turn(0.5) * i)); }},
        stated_drift);
  }
}

TEST(Paths, AreTheSameInTilesAndWithProgress) {
  TestDevice* device = test_device("opencl");
  if (!device) return report_missing("opencl");
  const Interrogator query(device->device, implicit("x^2+y^2+z^2-1", {glm::dvec3(-1.5), glm::dvec3(1.5)}));
  WalkStarts starts;
  for (const glm::vec3& v : random_directions(50)) starts.points.push_back(glm::normalize(v));
  starts.directions = random_directions(50, 8);
  starts.points[7] = {3, 0, 0};  // a path of one row
  const Paths whole = query.walk(starts.points, starts.directions, 0.3f, 4);
  std::size_t calls = 0, last = 0;
  const Paths tiled = query.walk(starts.points, starts.directions, 0.3f, 4,
                                 {.tile = 16, .progress = [&](std::size_t done, std::size_t total) {
                                    calls++;
                                    last = done;
                                    EXPECT_EQ(total, 200u);
                                  }});
  EXPECT_EQ(calls, 16u);
  EXPECT_EQ(last, 200u);
  EXPECT_EQ(whole.offsets, tiled.offsets);
  EXPECT_EQ(whole.status, tiled.status);
  EXPECT_EQ(whole.locations, tiled.locations);
  ASSERT_EQ(whole.offsets[8] - whole.offsets[7], 1u);
  EXPECT_EQ(whole.status[whole.offsets[7]], WalkStatus::off_surface);
}

}  // namespace
}  // namespace smurf::test
