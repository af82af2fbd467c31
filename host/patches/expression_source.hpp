// One surface s(u, v) by expressions as a source of pieces, with bounds by intervals of its exact derivatives.
#pragma once

#include <array>
#include <string>

#include "expression/graph.hpp"
#include "patches/piece_source.hpp"
#include "smurf/surface.hpp"

namespace smurf {

class ExpressionSource : public PieceSource {
 public:
  // Variables are u, v. Throws Error (input) where a text is wrong, as expression::parse does.
  ExpressionSource(const std::array<std::string, 3>& position, const ParameterBox& range,
                   const Parameters& parameters = {});

  std::size_t size() const override { return 1; }
  ParameterBox range(std::size_t) const override { return range_; }
  PatchPoint at(std::size_t piece, double u, double v) const override;
  // Nothing, too, where the surface may jump or have a crease: there derivatives bound nothing.
  std::optional<PieceBounds> bounds(std::size_t piece, const ParameterBox& box) const override;
  std::optional<SpaceBox> positions(std::size_t piece, const ParameterBox& box) const override;

  // x, y, z of s, s_u, s_v, s_uu, s_uv, s_vv, in variables 0 and 1.
  using Nodes = std::array<expression::NodeId, 18>;
  const expression::Graph& graph() const { return graph_; }
  const Nodes& nodes() const { return nodes_; }

 private:
  ParameterBox range_;
  expression::Graph graph_;
  Nodes nodes_{};
  expression::Program all_, position_;
};

}  // namespace smurf
