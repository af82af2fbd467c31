// Bounds of the second derivatives of a tricubic vector field, cell by cell.
//
// Derivatives of a B-spline are sums of differences of its coefficients with weights that are positive and add up to 1
// (de Boor 1978, X): so those of the coefficients that a cell is made of bound them.
#pragma once

#include <vector>

#include "smurf/flow.hpp"

namespace smurf {

class GridBends {
 public:
  explicit GridBends(const VectorGrid& grid);
  // Of |D²v[a, a]| for |a| = 1, in a box of space.
  double within(const Bounds& box) const;

 private:
  glm::ivec3 cells_{0};
  GridPlacement placement_;
  glm::dmat3 to_index_{1.0};
  std::vector<float> greatest_;  // of each cell
};

}  // namespace smurf
