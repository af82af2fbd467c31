// A vector field on a regular grid.
#pragma once

#include <memory>
#include <mutex>

#include "flows/definition.hpp"
#include "flows/grid/bends.hpp"

namespace smurf {

class GridFlow final : public VectorFieldDefinition {
 public:
  // Checked by grid_flow().
  GridFlow(VectorGrid grid, VectorReconstruction reconstruction);

  std::string_view kind() const override { return "grid"; }
  Bounds bounds() const override;
  int smoothness() const override { return reconstruction == VectorReconstruction::tricubic ? 2 : 0; }
  double greatest_speed() const override { return greatest_speed_; }
  double greatest_bend(const Bounds& box) const override;  // of tricubic fields
  std::vector<Fact> facts() const override;

  const VectorGrid grid;
  const VectorReconstruction reconstruction;

 private:
  double greatest_speed_ = 0;
  std::size_t non_finite_ = 0;
  mutable std::once_flag bends_made_;
  mutable std::unique_ptr<const GridBends> bends_;
};

}  // namespace smurf
