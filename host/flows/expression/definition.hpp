// A vector field given by three expressions, with their derivatives.
#pragma once

#include <array>
#include <optional>

#include "expression/graph.hpp"
#include "expression/interval.hpp"
#include "flows/definition.hpp"

namespace smurf {

class ExpressionFlow final : public VectorFieldDefinition {
 public:
  ExpressionFlow(const std::array<std::string, 3>& vector, const Domain& domain, const Parameters& parameters);

  std::string_view kind() const override { return "expression"; }
  Bounds bounds() const override { return {domain.lower, domain.upper}; }
  int smoothness() const override { return 3; }
  double greatest_speed() const override;
  double greatest_bend(const Bounds& box) const override;
  std::vector<Fact> facts() const override;

  const std::array<std::string, 3> texts;
  const Domain domain;
  // Nodes of `graph`: v; its derivatives by x, by y and by z; then by xx, yy, zz, xy, xz and yz: three each.
  const expression::Graph& graph() const { return graph_; }
  const std::array<expression::NodeId, 30>& nodes() const { return nodes_; }

 private:
  expression::Graph graph_;
  std::optional<expression::IntervalEvaluator> bends_;  // of the second derivatives
  std::array<expression::NodeId, 30> nodes_{};
};

}  // namespace smurf
