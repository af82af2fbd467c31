// Patches: tensor-product Bézier, B-spline and NURBS surfaces, polynomial and rational (Piegl, Tiller 1997, "The NURBS
// Book", chapters 1 to 4).
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

namespace smurf {

constexpr int most_patch_degree = 9;

// The surface s(u, v) = Σ N_i(u) N_j(v) P_ij over [k_degree, k_size] of the knots of each direction, projected from
// homogeneous coordinates: (x, y, z) / w. In the data's own units; u and v in those of the knots, which need be neither
// clamped nor within [0, 1]. A knot of degree + 1 times inside parts the patch, and there may be a gap.
struct Patch {
  std::array<int, 2> degree{};                 // in u and v, 1 to most_patch_degree
  std::array<int, 2> size{};                   // control points in u and v, at least degree + 1
  std::array<std::vector<double>, 2> knots{};  // size + degree + 1 each, never decreasing
  // (wx, wy, wz, w), size[0] · size[1] of them: control point (i, j) stands at j · size[0] + i. Weights are not
  // negative; where w is 0, (wx, wy, wz) is a direction and the point lies at infinity. Polynomial patches have w = 1.
  std::vector<glm::dvec4> points{};

  double lower(int direction) const {
    return knots[std::size_t(direction)][std::size_t(degree[std::size_t(direction)])];
  }
  double upper(int direction) const { return knots[std::size_t(direction)][std::size_t(size[std::size_t(direction)])]; }
};

// A Bézier patch of (degree_u + 1) · (degree_v + 1) points: knots are 0 and 1. Nothing is checked here; nurbs()
// (smurf/surface.hpp) does.
Patch bezier_patch(int degree_u, int degree_v, std::vector<glm::dvec4> points);

}  // namespace smurf
