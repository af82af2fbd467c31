// Lines of curvature on every executor, against curves that are known: circles of a torus, by equation, u and v, grid
// and mesh; on an ellipsoid the curves along which a confocal coordinate stays what it is, up to its umbilic points and
// through the star of a monkey saddle; on a sampled cylinder the tricubic reconstruction against the trilinear one.
#include "smurf/curvature_lines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "cases/interrogation/surfaces.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/refusal.hpp"
#include "smurf/interrogator.hpp"

KERNELS(find_hits, measure);

namespace smurf::test {
namespace {

constexpr double pi = std::numbers::pi;
using Status = CurvatureLineStatus;

CurvatureLines lines_on(TestDevice& device, const Surface& surface, const std::vector<glm::vec3>& seeds,
                        const CurvatureLineOptions& options) {
  return curvature_lines(Interrogator(device.device, surface), surface.bounds(), seeds, options);
}

Status end_of(const CurvatureLines& lines, std::size_t line) { return lines.status[lines.offsets[line + 1] - 1]; }
glm::dvec3 last_of(const CurvatureLines& lines, std::size_t line) {
  return glm::dvec3(lines.positions[lines.offsets[line + 1] - 1]);
}

// A torus of radii 1 and 0.4: k1 = 1/0.4 goes around the tube, in a plane with the axis; k2 along parallels.
void expect_circles(const Surface& surface, const std::string& what, double allowed) {
  std::vector<glm::vec3> seeds;
  std::vector<double> parallels;
  for (int i = 0; i < 6; i++) {
    const double u = 0.3 + i, v = 0.2 + 0.9 * i, radius = 1 + 0.4 * std::cos(v);
    seeds.emplace_back(radius * std::cos(u), radius * std::sin(u), 0.4 * std::sin(v));
    parallels.push_back(radius);
  }
  for (TestDevice& device : one_of_each()) {
    double worst[2] = {0, 0};
    for (const int principal : {1, 2}) {
      // Once around the tube, or a part of the way around the axis.
      const double length = principal == 1 ? 2 * pi * 0.4 : 2;
      const CurvatureLines lines = lines_on(device, surface, seeds, {.principal = principal, .length = length});
      for (std::size_t i = 0; i < lines.size(); i++) {
        EXPECT_EQ(end_of(lines, i), Status::length) << what << " on " << device.label << ", line " << i;
        for (std::size_t row = lines.offsets[i]; row < lines.offsets[i + 1]; row++) {
          const glm::dvec3 p(lines.positions[row]), seed(seeds[i]);
          const double around = std::hypot(p.x, p.y);
          const double off = principal == 1
                                 ? std::max(std::abs(p.x * seed.y - p.y * seed.x) / std::hypot(seed.x, seed.y),
                                            std::abs(std::hypot(around - 1, p.z) - 0.4))
                                 : std::max(std::abs(p.z - seed.z), std::abs(around - parallels[i]));
          worst[principal - 1] = std::max(worst[principal - 1], off);
        }
        if (principal == 1) {
          worst[0] = std::max(worst[0], glm::distance(last_of(lines, i), glm::dvec3(seeds[i])));
        }
      }
    }
    EXPECT_LE(std::max(worst[0], worst[1]), allowed) << what << " on " << device.label;
    std::cout << what << " on " << device.label << ": lines are off by " << worst[0] << " around the tube, " << worst[1]
              << " along parallels\n";
  }
}

TEST(CurvatureLines, CirclesOfATorus) {
  const Domain box{glm::dvec3(-1.5, -1.5, -0.5), glm::dvec3(1.5, 1.5, 0.5)};
  expect_circles(implicit("(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)", box), "torus by an equation", 1e-3);
  expect_circles(parametric({"(1+0.4*cos(v))*cos(u)", "(1+0.4*cos(v))*sin(u)", "0.4*sin(v)"}, {0, 2 * pi}, {0, 2 * pi}),
                 "torus by u and v", 1e-3);
  const auto density = [](double x, double y, double z) { return 0.4 - std::hypot(std::hypot(x, y) - 1, z); };
  expect_circles(isosurface(sampled(97, 1.5, density), 0.0), "torus on a grid", 1e-3);
  expect_circles(mesh_surface(torus_mesh(1, 0.4, 128, 64)), "torus of triangles", 5e-3);
}

// The ellipsoid x²/9 + y²/4 + z² = 1. Through each point go two confocal quadrics x²/(9-s) + y²/(4-s) + z²/(1-s) = 1
// besides, one with s in [1, 4], one with s in [4, 9] (Dupin): lines of curvature keep one of them.
struct Confocal {
  double low, high;
};
Confocal confocal(const glm::dvec3& p) {
  // The sum over axes of x²/(a-s) is 1 at s = 0, too: what is left is a quadratic s² - b s + c.
  const double x = p.x * p.x, y = p.y * p.y, z = p.z * p.z;
  const double b = 14 - (x + y + z);
  const double c = 49 - (x * 5 + y * 10 + z * 13);  // of 9·4 + 9·1 + 4·1, less x²(4+1) + y²(9+1) + z²(9+4)
  const double root = std::sqrt(std::max(b * b / 4 - c, 0.0));
  return {b / 2 - root, b / 2 + root};
}

Surface ellipsoid() { return implicit("x^2/9+y^2/4+z^2-1", {glm::dvec3(-3.2, -2.2, -1.2), glm::dvec3(3.2, 2.2, 1.2)}); }

TEST(CurvatureLines, ConfocalCurvesOfAnEllipsoid) {
  std::vector<glm::vec3> seeds;
  for (int i = 0; i < 8; i++) {
    const double u = 0.35 + 0.75 * i, v = -1.0 + 0.27 * i;
    seeds.emplace_back(3 * std::cos(u) * std::cos(v), 2 * std::sin(u) * std::cos(v), std::sin(v));
  }
  for (TestDevice& device : one_of_each()) {
    for (const int principal : {1, 2}) {
      const CurvatureLines lines =
          lines_on(device, ellipsoid(), seeds, {.principal = principal, .length = 4, .both = true});
      double worst = 0;
      for (std::size_t i = 0; i < lines.size(); i++) {
        EXPECT_EQ(end_of(lines, i), Status::length) << device.label << ", line " << i;
        EXPECT_EQ(lines.status[lines.offsets[i]], Status::length) << device.label << ", line " << i;
        const Confocal from = confocal(glm::dvec3(seeds[i]));
        double low = 0, high = 0;
        for (std::size_t row = lines.offsets[i]; row < lines.offsets[i + 1]; row++) {
          const Confocal at = confocal(glm::dvec3(lines.positions[row]));
          low = std::max(low, std::abs(at.low - from.low));
          high = std::max(high, std::abs(at.high - from.high));
        }
        worst = std::max(worst, std::min(low, high));
        EXPECT_GT(std::max(low, high), 0.05) << "line " << i << " goes nowhere";
      }
      EXPECT_LE(worst, 1e-3) << device.label << ", principal direction " << principal;
      std::cout << "ellipsoid on " << device.label << ", direction " << principal
                << ": the confocal coordinate changes by " << worst << "\n";
    }
  }
}

// In the plane of the longest and the shortest axis lines run into the four umbilic points, which are lemons: there
// they end, for no other separatrix of their own direction leads on.
TEST(CurvatureLines, UmbilicPointsOfAnEllipsoid) {
  const double x = 3 * std::sqrt(5.0 / 8), z = std::sqrt(3.0 / 8);
  for (TestDevice& device : one_of_each()) {
    for (const int principal : {1, 2}) {
      // Around the tip of the longest axis the plane's ellipse is of one direction, above the middle of the other.
      const double at = principal == 1 ? 0.3 : 1.3;
      const std::vector<glm::vec3> seeds{glm::vec3(3 * std::cos(at), 0, std::sin(at)),
                                         glm::vec3(-3 * std::cos(at), 0, -std::sin(at))};
      const CurvatureLines lines =
          lines_on(device, ellipsoid(), seeds, {.principal = principal, .length = 9, .both = true});
      for (std::size_t i = 0; i < lines.size(); i++) {
        for (const std::size_t row : {lines.offsets[i], lines.offsets[i + 1] - 1}) {
          const glm::dvec3 p(lines.positions[row]);
          EXPECT_EQ(lines.status[row], Status::umbilic) << device.label << ", direction " << principal;
          EXPECT_LE(glm::distance(glm::abs(p), glm::dvec3(x, 0, z)), 0.02)
              << device.label << ", direction " << principal << ": " << p.x << ", " << p.y << ", " << p.z;
        }
      }
    }
  }
}

// The flat point of a monkey saddle is a star: three separatrices of each direction, at 120 degrees.
TEST(CurvatureLines, ThroughAStar) {
  const Surface saddle = implicit("z-(x^3-3*x*y^2)", {glm::dvec3(-1), glm::dvec3(1)});
  for (TestDevice& device : one_of_each()) {
    std::size_t through = 0;
    for (const int principal : {1, 2}) {
      const CurvatureLines lines =
          lines_on(device, saddle, {glm::vec3(0.2f, 0, 0.008f)}, {.principal = principal, .length = 0.4, .both = true});
      for (std::size_t row = 0; row < lines.positions.size(); row++) {
        if (lines.status[row] != Status::umbilic) continue;
        EXPECT_LE(glm::length(lines.positions[row]), 0.02f) << device.label;
        through++;
        const bool first = lines.arcs[row] < 0;
        const glm::dvec3 end(first ? lines.positions.front() : lines.positions.back());
        EXPECT_GT(std::hypot(end.x, end.y), 0.1) << device.label;
        EXPECT_NEAR(std::abs(std::atan2(end.y, end.x)), 2 * pi / 3, 0.05) << device.label;
      }
    }
    EXPECT_EQ(through, 1u) << device.label << ": of one direction the x axis is a separatrix";
  }
}

TEST(CurvatureLines, RegionsBordersAndSeedsThatAreNowhere) {
  const Domain box{glm::dvec3(-1.5), glm::dvec3(1.5)};
  for (TestDevice& device : one_of_each()) {
    const CurvatureLines sphere =
        lines_on(device, implicit("x^2+y^2+z^2-1", box), {glm::vec3(0.6f, 0, 0.8f)}, {.length = 1});
    ASSERT_EQ(sphere.positions.size(), 1u) << device.label;
    EXPECT_EQ(end_of(sphere, 0), Status::umbilic) << device.label;
    // Along a cylinder to the border of its domain; a seed away from it, and one that is none.
    const std::vector<glm::vec3> seeds{glm::vec3(0, 1, 0), glm::vec3(0, 0.5f, 0), glm::vec3(NAN, 0, 0)};
    const CurvatureLines cylinder =
        lines_on(device, implicit("x^2+y^2-1", box), seeds, {.principal = 2, .length = 9, .both = true});
    ASSERT_EQ(cylinder.size(), 3u);
    EXPECT_EQ(end_of(cylinder, 0), Status::boundary) << device.label;
    EXPECT_EQ(cylinder.status[0], Status::boundary) << device.label;
    EXPECT_NEAR(std::abs(last_of(cylinder, 0).z), 1.5, 1e-3) << device.label;
    EXPECT_EQ(end_of(cylinder, 1), Status::undefined) << device.label;
    EXPECT_EQ(end_of(cylinder, 2), Status::undefined) << device.label;
  }
  const Surface surface = implicit("x^2+y^2-1", box);
  const Interrogator query(reference_device(), surface);
  const std::vector<glm::vec3> seeds{glm::vec3(0, 1, 0)};
  const auto refuse = [&](const CurvatureLineOptions& options) {
    refusal(ErrorCode::usage, [&] { curvature_lines(query, surface.bounds(), seeds, options); });
  };
  refuse({.principal = 3, .length = 1});
  refuse({.length = 0});
  refuse({.length = NAN});
  refuse({.length = 1, .step = -1});
}

// Figure 8 of the paper: on a sampled cylinder lines of the trilinear reconstruction stray, those of the tricubic one
// do not.
TEST(CurvatureLines, SampledCylinder) {
  const Volume volume = sampled(24, 1.5, [](double x, double y, double) { return 1 - std::hypot(x, y); });
  const std::vector<glm::vec3> seeds{glm::vec3(0.8f, 0.6f, 0.1f), glm::vec3(-0.28f, 0.96f, -0.3f),
                                     glm::vec3(0.1f, -0.995f, 0.4f)};
  for (TestDevice& device : one_of_each()) {
    double worst[2] = {0, 0};
    for (const bool cubic : {false, true}) {
      const Surface surface =
          isosurface(volume, 0.0, {.reconstruction = cubic ? Reconstruction::tricubic : Reconstruction::trilinear});
      const CurvatureLines lines = lines_on(device, surface, seeds, {.length = 2 * pi});
      for (std::size_t i = 0; i < lines.size(); i++) {
        for (std::size_t row = lines.offsets[i]; row < lines.offsets[i + 1]; row++) {
          const glm::dvec3 p(lines.positions[row]);
          worst[cubic ? 1 : 0] =
              std::max({worst[cubic ? 1 : 0], std::abs(p.z - double(seeds[i].z)), std::abs(std::hypot(p.x, p.y) - 1)});
        }
      }
    }
    EXPECT_LE(worst[1], 0.1 * worst[0]) << device.label;
    std::cout << "sampled cylinder on " << device.label << ": lines are off by " << worst[0] << " trilinear, "
              << worst[1] << " tricubic\n";
  }
}

}  // namespace
}  // namespace smurf::test
