// Where a gradient has sides: the creases of expressions with min, max and abs.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

#include "expression/graph.hpp"

namespace smurf {

// A choice in a gradient is open at a point if it may go either way at the places that round to the same floats, when
// evaluated in floats there, as far as intervals can tell; also where its arguments are equal.
class SidesOfGradient {
 public:
  SidesOfGradient(const expression::Graph& graph, const std::array<expression::NodeId, 3>& gradient);

  // The most that a component of the gradient changes by when open choices are taken otherwise; 0 where none is open,
  // and where that is not bounded.
  double apart(const glm::dvec3& point) const;
  std::size_t bytes() const;

 private:
  expression::Program gradient_;
  bool any_;  // choices at all
};

}  // namespace smurf
