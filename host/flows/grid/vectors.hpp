// Which vectors a field can be made of.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

namespace smurf {

// Of larger numbers the sums of a reconstruction could exceed floats.
constexpr float greatest_component = 1e36f;

inline bool is_usable(const glm::vec3& v) {
  const auto fits = [](float x) { return std::abs(x) <= greatest_component; };  // false for NaN
  return fits(v.x) && fits(v.y) && fits(v.z);
}

}  // namespace smurf
