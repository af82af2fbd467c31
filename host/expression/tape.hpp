// Long expressions as tapes: operations on numbered registers, one after the other, which a device interprets instead
// of compiling (Keeter 2020, "Massively parallel rendering of complex closed-form implicit surfaces").
//
// Where intervals show which argument a minimum, maximum or choice takes all over a box, what leads to the other one is
// left out.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "expression/graph.hpp"
#include "expression/interval.hpp"

namespace smurf::expression {

// A program of one root for a device. Throws Error (input) when a constant is too great for it.
Program device_program(const Graph& graph, NodeId root);

// What each node of the program is on a box of its variables.
void evaluate(const Program& program, std::span<const Interval> variables, std::vector<Interval>& values);

// The program without what cannot matter where its nodes lie in these intervals. An argument is left out only where it
// is defined.
Program pruned(const Program& program, std::span<const Interval> values);

// A tape, in words: the number of operations, the register of the result, then two words for each operation:
//   operation (5 bits), register of the result, first, second argument (9 bits each);
//   a float constant, an exponent or the number of a variable, or third and fourth argument (9 bits each).
// In place of a second argument constants have the upper 9 bits of their way (DeviceConstant), which are all that a
// power of two needs.
struct Tape {
  std::vector<std::uint32_t> words;
  int registers = 0;
};
constexpr int most_registers = 512;

// Throws Error (input) when more registers are needed.
Tape make_tape(const Program& program);

// The device function `head` { ... } that interprets a tape: `before` declares what the number type needs, `after`
// makes the result of the number `result`. It runs once for every tape that a lane has, and keeps with `select` what is
// the lane's.
struct Interpreter {
  std::string_view head, before, variable, select, result, after;
};
// Only usual operations and those that the program contains are known to it.
std::string interpreter_source(const Program& program, const Interpreter& words);

}  // namespace smurf::expression
