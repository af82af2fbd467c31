// Expressions as text:
//
//   + - * / ^   ^ is right-associative and binds tighter than a sign before it: -x^2 = -(x^2), 2^-3 = 1/8
//   numbers (2, .5, 1e-3), pi, e, the variables and parameters, parentheses
//   sin cos tan asin acos atan sinh cosh tanh exp log sqrt abs floor   of one argument
//   atan2 mod pow                                                      of two: atan2(y, x), mod(a, b), pow(a, b)
//   min max                                                            of two or more
//
// Products are always written with *. White space, and lines, do not matter.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>

#include "expression/graph.hpp"

namespace smurf::expression {

constexpr std::size_t longest_text = std::size_t(1) << 20;
constexpr int deepest_nesting = 1000;  // of parentheses and functions

// Variables are numbered as they stand in `variables`. Throws Error (input), one line that shows the place, what was
// found and what would be right. Takes time and memory in proportion to the text.
NodeId parse(Graph& graph, std::string_view text, std::span<const std::string> variables,
             const std::map<std::string, double>& parameters);

// For messages: on one line, printable, and when longer than `most` bytes only what is around byte `position`.
std::string excerpt(std::string_view text, std::size_t position = 0, std::size_t most = 60);

}  // namespace smurf::expression
