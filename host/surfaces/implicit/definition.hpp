// Surfaces given by expressions: f(x, y, z) = level in a domain. Implicit equations (level 0, normals out of f < 0) and
// isosurfaces of analytic fields (normals out of the denser side) are the same kind of surface.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "expression/graph.hpp"
#include "fields/domain.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

// A function of x, y, z with its exact derivatives, all in one graph.
struct ImplicitFunction {
  expression::Graph graph;
  expression::NodeId value = 0;
  std::array<expression::NodeId, 3> gradient{};  // by x, y, z
  std::array<expression::NodeId, 6> hessian{};   // xx, yy, zz, xy, xz, yz
  int degree = -1;                               // of a polynomial, -1 of any other function
};

// Adds the derivatives of the graph's function.
std::shared_ptr<const ImplicitFunction> differentiated(expression::Graph graph, expression::NodeId value);

class ImplicitSurface : public SurfaceDefinition {
 public:
  enum class Side { out_of_smaller = 1, out_of_greater = -1 };  // where normals come from, as the sign of ∇f in them

  // Throws Error (input) when the domain is empty or not finite, or the level is not finite.
  ImplicitSurface(std::string kind, std::string text, std::shared_ptr<const ImplicitFunction> function, double level,
                  Side side, const Domain& domain);
  std::string_view kind() const override { return kind_; }
  Bounds bounds() const override { return {domain.lower, domain.upper}; }
  std::uint32_t properties() const override;
  std::vector<Fact> facts() const override;
  std::optional<InsideOfLevel> inside_of_level() const override {
    return InsideOfLevel{level, side == Side::out_of_greater};
  }
  std::optional<AnalyticField> analytic_field() const override;
  RootResolver root_resolver() const override;

  const std::string text;  // as the user wrote it
  const std::shared_ptr<const ImplicitFunction> function;
  const double level;
  const Side side;
  const Domain domain;

 private:
  std::string kind_;
};

}  // namespace smurf
