// A vector field on a regular grid.
#pragma once

#include "flows/definition.hpp"

namespace smurf {

class GridFlow final : public VectorFieldDefinition {
 public:
  // Checked by grid_flow().
  GridFlow(VectorGrid grid, VectorReconstruction reconstruction);

  std::string_view kind() const override { return "grid"; }
  Bounds bounds() const override;
  int smoothness() const override { return reconstruction == VectorReconstruction::tricubic ? 2 : 0; }
  double greatest_speed() const override { return greatest_speed_; }
  std::vector<Fact> facts() const override;

  const VectorGrid grid;
  const VectorReconstruction reconstruction;

 private:
  double greatest_speed_ = 0;
  std::size_t non_finite_ = 0;
};

}  // namespace smurf
