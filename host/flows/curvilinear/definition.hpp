// A vector field on curvilinear blocks. A rectilinear grid is one whose nodes happen to stand in lines.
#pragma once

#include "flows/definition.hpp"

namespace smurf {

class CurvilinearFlow final : public VectorFieldDefinition {
 public:
  // Checked by curvilinear_flow(). `kind` is "curvilinear" or "rectilinear".
  CurvilinearFlow(std::string_view kind, std::vector<CurvilinearBlock> blocks, VectorReconstruction reconstruction,
                  double tolerance);

  std::string_view kind() const override { return kind_; }
  Bounds bounds() const override { return bounds_; }
  int smoothness() const override { return reconstruction == VectorReconstruction::tricubic ? 2 : 0; }
  double greatest_speed() const override { return greatest_speed_; }
  std::vector<Fact> facts() const override;

  const std::vector<CurvilinearBlock> blocks;
  const VectorReconstruction reconstruction;
  const double tolerance;  // of locations, in units of space; not 0

 private:
  std::string_view kind_;
  Bounds bounds_;
  double greatest_speed_ = 0;
};

}  // namespace smurf
