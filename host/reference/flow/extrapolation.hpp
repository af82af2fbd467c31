// Differences extrapolated to step 0 (Richardson; Ridders 1982, "Accurate computation of F'(x) and F'(x)F''(x)").
#pragma once

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace smurf {

inline bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
inline double greatest(const glm::dvec3& v) {
  return std::fmax(std::fmax(std::abs(v.x), std::abs(v.y)), std::abs(v.z));
}

// Of `difference(k)`, k = 0, 1, ..., whose error is a series in even powers of a step that halves with each k. Where
// rounding takes over, the tableau's entries part again: the entry that agrees best with its neighbours is taken.
// Differences that are not finite begin the tableau anew. NaN where fewer than two are finite.
template <int levels, class Difference>
glm::dvec3 extrapolated(const Difference& difference) {
  glm::dvec3 best(std::numeric_limits<double>::quiet_NaN());
  double least = std::numeric_limits<double>::infinity();
  std::array<glm::dvec3, levels> row{}, above{};
  int length = 0;  // of the row above
  for (int k = 0; k < levels; k++) {
    row[0] = difference(k);
    if (!is_finite(row[0])) {
      length = 0;
      continue;
    }
    double power = 1;
    for (int j = 1; j <= length; j++) {
      power *= 4;
      const auto at = std::size_t(j);
      row[at] = row[at - 1] + (row[at - 1] - above[at - 1]) / (power - 1);
      const double error = std::fmax(greatest(row[at] - row[at - 1]), greatest(row[at] - above[at - 1]));
      if (error < least) {
        least = error;
        best = row[at];
      }
    }
    above = row;
    length++;
  }
  return best;
}

}  // namespace smurf
