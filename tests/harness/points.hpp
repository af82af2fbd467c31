// What devices measure at points against what is known there, for surfaces of every kind: normal, curvatures, and
// directions up to sign. Errors are told in parts of what is allowed, with the worst place of each.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "smurf/interrogator.hpp"
#include "truth/jet.hpp"

namespace smurf::test {

inline constexpr double not_compared = HUGE_VAL;

// The surface at a point, and how far each answer may be from it.
struct PointTruth {
  Differential exact;
  double normal = not_compared;     // length of the difference of unit vectors
  double mean = not_compared;       // of k1 + k2 over 2
  double gauss = not_compared;      // of k1·k2
  double principal = not_compared;  // of k1 and of k2
  double along = not_compared;      // of the normal curvature along the direction that was asked about
  double direction = not_compared;  // sine of the angle of either principal direction, up to sign, off umbilics
};

// Nothing where point i is not compared.
using PointOracle = std::function<std::optional<PointTruth>(std::size_t i, const glm::dvec3& point)>;

struct PointErrors {
  struct Worst {
    double error = 0;  // in parts of what is allowed
    std::size_t at = 0;
  };
  std::size_t compared = 0;
  std::map<std::string, Worst> worst;  // by quantity

  double of(const std::string& quantity) const;
  std::string summary() const;
};

// Compares what was measured at the first `count` points. `directions` and `along` are what normal curvatures were
// asked for and what they are.
PointErrors compare_points(const PointProperties& measured, std::span<const glm::vec3> points, std::size_t count,
                           const PointOracle& oracle, std::span<const glm::vec3> directions = {},
                           std::span<const float> along = {});

// Fails for each quantity that errs by more than is allowed, and says where.
void expect_points(const PointErrors& errors, std::span<const glm::vec3> points, const std::string& where);

}  // namespace smurf::test
