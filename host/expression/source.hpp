// Expressions as device source, in the common subset of OpenCL C and GLSL: one statement per operation, over
// macros, so that one text serves several number types (numbers, intervals, numbers with derivatives).
//
//   NUMBER n0 = OP_MULTIPLY_CONSTANT(v0, 2.5f);
//   NUMBER n1 = OP_SIN(n0);
//   NUMBER n2 = OP_POWER_INTEGER(n1, 3);
//
// The kernels define NUMBER and, of OP_<NAME>(arguments):
//
//   CONSTANT(c)
//   NEGATE ABS SIGN FLOOR SQRT EXP LOG SIN COS TAN ASIN ACOS ATAN SINH COSH TANH (a)
//   ADD SUBTRACT MULTIPLY DIVIDE POW ATAN2 MIN MAX MOD                          (a, b)
//   ADD_CONSTANT MULTIPLY_CONSTANT                                              (a, c)
//   INEXACT(c, e)  ADD_INEXACT MULTIPLY_INEXACT                                 (a, c, e)
//   POWER_INTEGER                                                               (a, n), n an int literal
//   CHOOSE                                                                      (a, b, c, d): a <= b ? c : d
//
// Here a, b, ... are names; c and e are float literals, with their sign and the suffix f. Constants are rounded to
// float. What is no float is an inexact constant (DeviceConstant), of which arithmetics that prove something must take
// account.
//
// Operations that are decided otherwise, which of its arguments a minimum takes or which sign an absolute value's
// argument has, are written OP_<NAME>_BY(decision, arguments).
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "expression/graph.hpp"

namespace smurf::expression {

// The statements, and in `names` one name per root, which is a statement's or a variable's. Statements are named
// <prefix>n0, <prefix>n1, ...; variables are v0, v1, ... whatever the prefix. Throws Error (input) when a constant is
// too great for a float. `decision` gives the text of an operation's decision, empty for none.
std::string device_source(const Graph& graph, std::span<const NodeId> roots, std::string_view prefix,
                          std::vector<std::string>& names,
                          const std::function<std::string(const Node&)>& decision = {});

// A whole function: its head, `before`, the statements, and `after`, in which {0}, {1}, ... are the names of the roots.
// Braces of the language are doubled there.
std::string function_source(const Graph& graph, std::span<const NodeId> roots, std::string_view head,
                            std::string_view before, std::string_view after,
                            const std::function<std::string(const Node&)>& decision = {});

// The name of an operation in its macro; a variable has none.
std::string_view device_word(Op op);

// A constant as devices have it: the nearest float, and the way to another one so that the constant lies between both,
// at most half of the way off; 0 where it is exact. Ways are powers of two of 2^-126 or more: floats have gaps that
// wide about 0, where devices have no others.
struct DeviceConstant {
  float value, way;
};
// Throws Error (input) when it is too great.
DeviceConstant device_constant(double value);

// A literal that reads back to the same float in both languages.
std::string float_literal(float value);

}  // namespace smurf::expression
