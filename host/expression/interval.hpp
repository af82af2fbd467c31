// Bounds of expressions over boxes, in double precision. A result encloses every value that the function takes where
// it is defined in the box, in real arithmetic and as Evaluator computes it. Bounds are rounded outwards: by one
// step where the operation is correctly rounded, by a few where it is a library function.
//
// `defined` is false when the function may be undefined somewhere in the box. Overflow to infinity is not that: then
// the bounds are infinite.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "expression/graph.hpp"

namespace smurf::expression {

struct Interval {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool defined = true;

  bool contains(double v) const { return low <= v && v <= high; }
};

// One operation, as `apply` of evaluate.hpp.
Interval apply(Op op, double value, const Interval& a, const Interval& b, const Interval& c, const Interval& d);

class IntervalEvaluator {
 public:
  IntervalEvaluator(const Graph& graph, std::span<const NodeId> roots) : program_(make_program(graph, roots)) {}

  // One result per root.
  void operator()(std::span<const Interval> variables, std::span<Interval> results,
                  std::vector<Interval>& scratch) const;

 private:
  Program program_;
};

}  // namespace smurf::expression
