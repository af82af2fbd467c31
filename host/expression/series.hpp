// Expressions along a line, as Taylor series with proved bounds, in double precision.
//
// A function of s in [-1, 1] is known by bounds on its value and on its Taylor coefficients (derivatives over
// factorials), taken at one place or over all of a stretch. With c_k at the middle and C_k over the stretch, Taylor's
// theorem says f(s) = c_0 + c_1 s + ... + c_{k-1} s^{k-1} + C_k s^k. Bounds are rounded outwards; an infinite bound is
// none.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "expression/graph.hpp"

namespace smurf::expression {

struct Bound {
  double low = 0, high = 0;

  bool is_finite() const;
  bool contains_zero() const { return low <= 0 && high >= 0; }
  double magnitude() const;  // the greatest absolute value
};
Bound operator+(const Bound& a, const Bound& b);
Bound operator-(const Bound& a);
Bound operator-(const Bound& a, const Bound& b);
Bound operator*(const Bound& a, const Bound& b);
Bound operator/(const Bound& a, const Bound& b);  // without bounds where b contains 0

constexpr int series_order = 4;

struct Series {
  std::array<Bound, series_order + 1> at{};  // Taylor coefficients
  // Defined all over the stretch. Otherwise the bounds hold where it is defined.
  bool defined = true;
  // Continuous, and every difference quotient lies in at[1]; creases keep that, jumps do not.
  bool continuous = true;
  bool nowhere = false;  // an operation is defined nowhere on the stretch
};

// One operation, as `apply` of evaluate.hpp. Coefficients beyond a crease that is not decided have no bounds.
Series apply(Op op, double value, const Series& a, const Series& b, const Series& c, const Series& d);

// The series of a program of one root; `variables` are those of its variables. Leaves that of each node in `nodes`.
Series evaluate(const Program& program, std::span<const Series> variables, std::vector<Series>& nodes);
// Over a stretch, where those of its middle are known: values lie also where slopes allow them to be from the middle
// on, which is much closer on short stretches, and decides creases.
Series evaluate(const Program& program, std::span<const Series> variables, std::span<const Series> middle,
                std::vector<Series>& nodes);

}  // namespace smurf::expression
