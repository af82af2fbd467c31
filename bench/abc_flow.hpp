// The flow of Arnold, Beltrami and Childress with a = √3, b = √2, c = 1, of W5: on a grid of 64³ over [0, 2π]³, and as
// an expression.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "smurf/flow.hpp"

namespace smurf::bench {

constexpr double turn = 2 * std::numbers::pi;

inline glm::dvec3 abc(const glm::dvec3& p) {
  const double a = std::numbers::sqrt3, b = std::numbers::sqrt2, c = 1;
  return {a * std::sin(p.z) + c * std::cos(p.y), b * std::sin(p.x) + a * std::cos(p.z),
          c * std::sin(p.y) + b * std::cos(p.x)};
}

inline VectorGrid abc_grid() {
  constexpr int nodes = 64;
  VectorGrid grid;
  grid.size = glm::ivec3(nodes);
  const double step = turn / (nodes - 1);
  grid.placement = spacing(step, step, step);
  for (int k = 0; k < nodes; k++) {
    for (int j = 0; j < nodes; j++) {
      for (int i = 0; i < nodes; i++) grid.vectors.emplace_back(abc(glm::dvec3(i, j, k) * step));
    }
  }
  return grid;
}

inline VectorField abc_expression(const Domain& domain = {glm::dvec3(0), glm::dvec3(turn)}) {
  return expression_flow({"sqrt(3)*sin(z)+cos(y)", "sqrt(2)*sin(x)+sqrt(3)*cos(z)", "sin(y)+sqrt(2)*cos(x)"}, domain);
}

}  // namespace smurf::bench
