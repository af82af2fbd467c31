// What is true of every step of a walk, whatever the surface.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/glm.hpp>
#include <random>
#include <string>
#include <vector>

#include "harness/devices.hpp"
#include "smurf/smurf.hpp"

namespace smurf::test {

constexpr double rounding = 0x1p-24;

struct WalkStarts {
  std::vector<glm::vec3> points, directions;
};

// Directions that are neither unit nor tangent.
inline std::vector<glm::vec3> random_directions(std::size_t count, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<glm::vec3> directions(count);
  for (glm::vec3& d : directions) d = {normal(random), normal(random), normal(random)};
  return directions;
}

// Hits of rays from all over a ball around the surface, in all directions.
inline WalkStarts random_starts(const Interrogator& query, const Bounds& bounds, std::size_t count, unsigned seed = 3) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto unit = [&] { return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))); };
  const glm::dvec3 centre = 0.5 * (bounds.lower + bounds.upper);
  const double radius = 0.5 * glm::length(bounds.upper - bounds.lower);
  std::vector<Ray> rays;
  while (rays.size() < 4 * count) {
    const glm::dvec3 from = centre + radius * unit(), to = centre + 0.8 * radius * unit();
    rays.push_back({glm::vec3(from), glm::vec3(to - from), 0.0f, 3.0f});
  }
  const HitList hits = query.cast(RayBatch(rays));
  WalkStarts starts;
  for (std::size_t i = 0; i < std::min(count, hits.size()); i++) starts.points.push_back(hits.locations()[i]);
  starts.directions = random_directions(starts.points.size(), seed + 1);
  return starts;
}

struct WalkTolerances {
  double chord = 1e-5;    // of the distance, beside the rounding of coordinates
  double plane = 2e-5;    // the same
  double surface = 1e-5;  // distance from the surface, of the distance walked; the same
};

// How far a point is from the surface, about.
using DistanceFrom = std::function<double(const glm::dvec3&)>;

// Chord, plane, side and surface of what was reached; directions are unit and tangent. How many were reached.
inline std::size_t expect_steps(const Neighbors& next, const WalkStarts& starts, std::span<const glm::vec3> normals,
                                double distance, const DistanceFrom& from_surface, const WalkTolerances& tolerances) {
  std::size_t reached = 0;
  for (std::size_t i = 0; i < next.size(); i++) {
    if (!goes_on(next.status[i])) continue;
    reached++;
    const glm::dvec3 p(starts.points[i]), q(next.locations[i]), n(normals[i]), d(starts.directions[i]);
    const double size = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    const auto allowed = [&](double part) { return part * distance + 4 * rounding * size; };
    EXPECT_NEAR(glm::distance(p, q), distance, allowed(tolerances.chord)) << i;
    EXPECT_NEAR(next.chords[i], distance, allowed(tolerances.chord)) << i;
    const glm::dvec3 across = glm::normalize(glm::cross(n, d));
    EXPECT_LE(std::abs(glm::dot(across, q - p)), allowed(tolerances.plane)) << i;
    EXPECT_LE(from_surface(q), allowed(tolerances.surface)) << i << fmt::format(" at ({}, {}, {})", q.x, q.y, q.z);
    EXPECT_NEAR(glm::length(glm::dvec3(next.directions[i])), 1, 8 * rounding) << i;
    EXPECT_NEAR(glm::dot(glm::dvec3(next.directions[i]), glm::dvec3(next.normals[i])), 0, 8 * rounding) << i;
  }
  return reached;
}

// Of the same questions asked of the reference: how many statuses differ, and places that are farther apart than
// `allowed`.
inline std::size_t count_other(const Neighbors& a, const Neighbors& b, double allowed) {
  std::size_t other = 0;
  for (std::size_t i = 0; i < a.size(); i++)
    other += a.status[i] != b.status[i] || !(glm::distance(a.locations[i], b.locations[i]) <= float(allowed));
  return other;
}

}  // namespace smurf::test
