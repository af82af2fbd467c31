// Tensor-product patches as files give them: Bézier, B-spline and NURBS, polynomial and rational (Piegl, Tiller 1997).
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace smurf {

constexpr int most_patch_degree = 9;

struct Patch {
  std::array<int, 2> degree{};                 // in u and v
  std::array<int, 2> size{};                   // control points in u and v
  std::array<std::vector<double>, 2> knots{};  // size + degree + 1 each; the patch lies over [k_degree, k_size]
  std::vector<glm::dvec4> points{};            // homogeneous: (wx, wy, wz, w); u runs fastest

  double lower(int direction) const {
    return knots[std::size_t(direction)][std::size_t(degree[std::size_t(direction)])];
  }
  double upper(int direction) const { return knots[std::size_t(direction)][std::size_t(size[std::size_t(direction)])]; }
};

// A Bézier patch: knots are 0 and 1.
Patch bezier_patch(int degree_u, int degree_v, std::vector<glm::dvec4> points);

// Throws Error (input) that begins with `what`, when degrees are not 1 to 9, counts do not fit each other, numbers are
// not finite, knots decrease or one of them stands more than degree + 1 times, the range is empty, or a weight is
// negative. Weights may be 0: such control points lie at infinity.
void require_valid(const Patch& patch, const std::string& what);

}  // namespace smurf
