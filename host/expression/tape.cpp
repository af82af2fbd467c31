#include "expression/tape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "expression/source.hpp"
#include "smurf/error.hpp"

namespace smurf::expression {
namespace {

// Codes of operations: those of Op, and sums and products with constants.
constexpr int add_constant = operation_count;
constexpr int multiply_constant = operation_count + 1;
static_assert(multiply_constant < 32, "operations are coded in five bits");
constexpr int register_bits = 9;
static_assert(most_registers == 1 << register_bits);

constexpr NodeId none = std::numeric_limits<NodeId>::max();

// The argument of a sum or product that is a constant, written into the operation; the graph puts it second.
bool takes_constant(const Program& program, const Node& node) {
  return (node.op == Op::add || node.op == Op::multiply) && program.nodes[node.arguments[1]].op == Op::constant;
}

int arguments_of(const Program& program, const Node& node) {
  return takes_constant(program, node) ? 1 : arity(node.op);
}

// The argument that a node is equal to wherever its arguments lie in these intervals; none if it is not known.
NodeId equal_argument(const Node& node, std::span<const Interval> values) {
  const NodeId a = node.arguments[0], b = node.arguments[1];
  const auto decided = [&](bool first, bool second, NodeId if_first, NodeId if_second) {
    if (first && values[if_second].defined) return if_first;
    if (second && values[if_first].defined) return if_second;
    return none;
  };
  switch (node.op) {
    case Op::min:
      return decided(values[a].high <= values[b].low, values[b].high <= values[a].low, a, b);
    case Op::max:
      return decided(values[a].low >= values[b].high, values[b].low >= values[a].high, a, b);
    case Op::abs:
      return values[a].low >= 0 ? a : none;
    case Op::choose:
      if (!values[a].defined || !values[b].defined) return none;
      return decided(values[a].high <= values[b].low, values[a].low > values[b].high, node.arguments[2],
                     node.arguments[3]);
    default:
      return none;
  }
}

}  // namespace

Program device_program(const Graph& graph, NodeId root) {
  const std::vector<NodeId> roots{root};
  Program program = make_program(graph, roots);
  for (const Node& node : program.nodes) {
    if (node.op == Op::constant) device_constant(node.value);
  }
  return program;
}

void evaluate(const Program& program, std::span<const Interval> variables, std::vector<Interval>& values) {
  const auto variable = [&](std::size_t i) { return variables[i]; };
  const auto checked = [](Op op, double value, const Interval& a, const Interval& b, const Interval& c,
                          const Interval& d) {
    const Interval result = apply(op, value, a, b, c, d);
    return result.low <= result.high ? result : Interval{.defined = false};
  };
  std::array<Interval, 1> result;
  run_program<Interval>(program, variable, checked, result, values);
}

Program pruned(const Program& program, std::span<const Interval> values) {
  const std::size_t count = program.nodes.size();
  // Which node stands for each, its decisions taken.
  std::vector<NodeId> standing(count);
  for (std::size_t i = 0; i < count; i++) {
    const NodeId equal = equal_argument(program.nodes[i], values);
    standing[i] = equal == none ? NodeId(i) : standing[equal];
  }
  std::vector<bool> needed(count, false);
  needed[standing[program.roots[0]]] = true;
  for (std::size_t i = count; i-- > 0;) {
    if (!needed[i]) continue;
    const Node& node = program.nodes[i];
    for (int k = 0; k < arity(node.op); k++) needed[standing[node.arguments[std::size_t(k)]]] = true;
  }
  Program result;
  result.variables = program.variables;
  std::vector<NodeId> places(count);
  for (std::size_t i = 0; i < count; i++) {
    if (!needed[i]) continue;
    Node node = program.nodes[i];
    for (int k = 0; k < arity(node.op); k++) {
      NodeId& argument = node.arguments[std::size_t(k)];
      argument = places[standing[argument]];
    }
    places[i] = NodeId(result.nodes.size());
    result.nodes.push_back(node);
  }
  result.roots.push_back(places[standing[program.roots[0]]]);
  return result;
}

Tape make_tape(const Program& program) {
  const std::size_t count = program.nodes.size();
  std::vector<std::size_t> last_use(count, 0);
  std::vector<bool> used(count, false);  // other than as a constant within an operation
  for (std::size_t i = 0; i < count; i++) {
    const Node& node = program.nodes[i];
    for (int k = 0; k < arguments_of(program, node); k++) {
      last_use[node.arguments[std::size_t(k)]] = i;
      used[node.arguments[std::size_t(k)]] = true;
    }
  }
  last_use[program.roots[0]] = count;
  used[program.roots[0]] = true;

  Tape tape;
  tape.words = {0, 0};
  std::vector<std::uint32_t> place(count);
  std::vector<std::uint32_t> unused;  // registers that are free, the latest first
  for (std::size_t i = 0; i < count; i++) {
    if (!used[i]) continue;
    const Node& node = program.nodes[i];
    const bool constant = takes_constant(program, node);
    std::array<std::uint32_t, 4> from{};
    for (int k = 0; k < arguments_of(program, node); k++) from[std::size_t(k)] = place[node.arguments[std::size_t(k)]];
    // Arguments that are not needed any more make room for the result; each once.
    for (int k = 0; k < arguments_of(program, node); k++) {
      const NodeId argument = node.arguments[std::size_t(k)];
      const auto same = std::find(node.arguments.begin(), node.arguments.begin() + k, argument);
      if (last_use[argument] == i && same == node.arguments.begin() + k) unused.push_back(place[argument]);
    }
    if (unused.empty()) {
      place[i] = std::uint32_t(tape.registers++);
    } else {
      place[i] = unused.back();
      unused.pop_back();
    }
    if (tape.registers > most_registers) {
      throw Error(ErrorCode::input, fmt::format("an expression of {} operations that has more than {} results waiting "
                                                "at a time; a device has no room for more",
                                                count, most_registers));
    }
    std::uint32_t code = std::uint32_t(node.op), more = 0;
    if (constant) code = node.op == Op::add ? add_constant : multiply_constant;
    if (constant || node.op == Op::constant) {
      const DeviceConstant c = device_constant(constant ? program.nodes[node.arguments[1]].value : node.value);
      more = std::bit_cast<std::uint32_t>(c.value);
      from[1] = std::bit_cast<std::uint32_t>(c.way) >> (5 + 2 * register_bits);
    } else if (node.op == Op::power_integer || node.op == Op::variable) {
      more = std::uint32_t(int(node.value));
    } else {
      more = from[2] | from[3] << register_bits;
    }
    tape.words.push_back(code | place[i] << 5 | from[0] << (5 + register_bits) | from[1] << (5 + 2 * register_bits));
    tape.words.push_back(more);
    tape.words[0]++;
  }
  tape.words[1] = place[program.roots[0]];
  return tape;
}

std::string interpreter_source(const Program& program, const Interpreter& words) {
  // Those that are usual are always there, so that most expressions share their program.
  std::set<int> codes = {add_constant, multiply_constant};
  for (const Op op : {Op::constant, Op::variable, Op::negate, Op::add, Op::subtract, Op::multiply, Op::power_integer,
                      Op::min, Op::max, Op::abs, Op::sqrt})
    codes.insert(int(op));
  for (const Node& node : program.nodes) {
    codes.insert(int(node.op));
    if (takes_constant(program, node)) codes.insert(node.op == Op::add ? add_constant : multiply_constant);
  }
  std::string cases;
  for (const int code : codes) {
    std::string value;
    if (code == add_constant || code == multiply_constant) {
      value = fmt::format("OP_{}_INEXACT(a, as_plain_real(more), way)", code == add_constant ? "ADD" : "MULTIPLY");
    } else {
      const Op op = Op(code);
      const std::string_view word = device_word(op);
      if (op == Op::constant) value = "OP_INEXACT(as_plain_real(more), way)";
      if (op == Op::variable) value = fmt::format("{}", words.variable);
      if (op == Op::power_integer) value = "OP_POWER_INTEGER(a, more)";
      if (op == Op::choose) value = "OP_CHOOSE(a, b, registers[more & 511], registers[(more >> 9) & 511])";
      if (value.empty()) value = fmt::format("OP_{}({})", word, arity(op) == 1 ? "a" : "a, b");
    }
    fmt::format_to(std::back_inserter(cases), "        case {}: r = {}; break;\n", code, value);
  }
  return fmt::format(R"({head} {{
{before}  NUMBER registers[TAPE_REGISTERS];
  registers[0] = v0;
{result}
  mask left = mask_all();
  while (any_lane(left)) {{
    int at = least_lane(left ? tape.at : splat_integer(2147483647));
    mask here = left && tape.at == at;
    int count = load_uniform_integer(tape.words, at);
    for (int i = 0; i < count; i++) {{
      int code = load_uniform_integer(tape.words, at + 2 + 2 * i);
      int more = load_uniform_integer(tape.words, at + 3 + 2 * i);
      NUMBER a = registers[(code >> 14) & 511];
      NUMBER b = registers[(code >> 23) & (TAPE_REGISTERS - 1)];  // constants have no second argument
      float way = as_plain_real(code & -8388608);
      NUMBER r = a;
      switch (code & 31) {{
{cases}      }}
      registers[(code >> 5) & 511] = r;
    }}
    NUMBER r = registers[load_uniform_integer(tape.words, at + 1)];
{select}
    left = left && !here;
  }}
{after}}}
)",
                     fmt::arg("head", words.head), fmt::arg("before", words.before), fmt::arg("result", words.result),
                     fmt::arg("cases", cases), fmt::arg("select", words.select), fmt::arg("after", words.after));
}

}  // namespace smurf::expression
