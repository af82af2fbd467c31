// Interpolation of vectors at the nodes of a lattice by cubic B-splines, in double precision.
//
// The coefficients solve the banded systems (c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i] along each axis directly. At the ends
// of an axis the second derivative is 0 (natural), c[-1] = 2 c[0] - c[1]; along a periodic one, whose last plane of
// nodes repeats the first, the system is cyclic. Beyond the ends of a natural axis the spline goes on as a line.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

namespace smurf {

class LatticeSpline {
 public:
  LatticeSpline() = default;
  LatticeSpline(const glm::ivec3& size, std::vector<glm::dvec3> nodes, const std::array<bool, 3>& periodic);

  // In the cell, continued by its own polynomial where `local` is not within 0 to 1. Jacobian: by local coordinates;
  // may be null.
  glm::dvec3 at(const glm::ivec3& cell, const glm::dvec3& local, glm::dmat3* jacobian) const;
  // The 64 coefficients of a cell span all that it takes on for local coordinates from 0 to 1.
  void box(const glm::ivec3& cell, glm::dvec3& lower, glm::dvec3& upper) const;

 private:
  // With one more at each end of each axis.
  const glm::dvec3& coefficient(int i, int j, int k) const {
    return coefficients_[(std::size_t(k) * std::size_t(padded_.y) + std::size_t(j)) * std::size_t(padded_.x) +
                         std::size_t(i)];
  }

  glm::ivec3 padded_{0};
  std::vector<glm::dvec3> coefficients_;
};

// Of eight corners, i fastest.
glm::dvec3 trilinear(const std::array<glm::dvec3, 8>& corners, const glm::dvec3& local, glm::dmat3* jacobian);

}  // namespace smurf
