// Expressions in double precision. What is undefined gives NaN: logarithms of numbers that are not positive, roots of
// negative ones, quotients by zero, powers of a negative base with an exponent that is no integer, zero to a negative
// power, atan2(0, 0), asin and acos outside [-1, 1]. Overflow gives infinity.
#pragma once

#include <span>
#include <vector>

#include "expression/graph.hpp"

namespace smurf::expression {

// One operation; `value` as in Node. Constants are their value, variables have none here.
double apply(Op op, double value, double a, double b, double c, double d);

// Keeps what it needs of the graph. May be shared by threads, each with its own scratch.
class Evaluator {
 public:
  Evaluator(const Graph& graph, std::span<const NodeId> roots) : program_(make_program(graph, roots)) {}

  // One result per root; scratch is made as large as it must be.
  void operator()(std::span<const double> variables, std::span<double> results, std::vector<double>& scratch) const;

  int variables() const { return program_.variables; }

 private:
  Program program_;
};

}  // namespace smurf::expression
