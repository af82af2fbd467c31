// A vector field given by a user's own device source, known by its values alone.
#pragma once

#include "flows/definition.hpp"

namespace smurf {

class SourceFlow final : public VectorFieldDefinition {
 public:
  // Checked by source_flow().
  SourceFlow(FlowSource source, const Domain& domain);

  std::string_view kind() const override { return "source"; }
  Bounds bounds() const override { return {domain.lower, domain.upper}; }
  int smoothness() const override { return 2; }  // taken to be so
  double greatest_speed() const override;
  std::vector<Fact> facts() const override;

  const FlowSource function;
  const Domain domain;
};

}  // namespace smurf
