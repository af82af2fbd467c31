// Errors gathered one by one, and the random chords along which comparisons look.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

#include "smurf/compare.hpp"
#include "smurf/rays.hpp"

namespace smurf {

struct Errors {
  std::size_t count = 0;
  double squares = 0, greatest = 0;

  void add(double error) {
    count++;
    squares += error * error;
    greatest = std::max(greatest, std::abs(error));
  }
  double rms() const {
    return count > 0 ? std::sqrt(squares / double(count)) : std::numeric_limits<double>::quiet_NaN();
  }
  ErrorMeasure measure() const { return {rms(), count > 0 ? greatest : std::numeric_limits<double>::quiet_NaN()}; }
};

inline double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 cross = glm::cross(a, b);
  return std::atan2(std::sqrt(glm::dot(cross, cross)), glm::dot(a, b));
}

// Isotropic lines through the box: they enter evenly over its faces, in directions by the cosine to the face.
RayBatch chords_of(const Bounds& box, std::size_t count, std::uint64_t seed);

}  // namespace smurf
