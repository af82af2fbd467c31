#include "expression/source.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "smurf/error.hpp"

namespace smurf::expression {
namespace {

// clang-format off
// In the order of Op; a variable has no statement.
constexpr std::array<std::string_view, operation_count> words = {
    "CONSTANT", "", "NEGATE", "ABS", "SIGN", "FLOOR", "SQRT", "EXP", "LOG", "SIN", "COS",
    "TAN", "ASIN", "ACOS", "ATAN", "SINH", "COSH", "TANH",
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "POWER_INTEGER", "POW", "ATAN2", "MIN", "MAX", "MOD",
    "CHOOSE"};
// clang-format on

// The graph puts the constant of a sum or product second.
bool takes_constant(const Program& program, const Node& node) {
  return (node.op == Op::add || node.op == Op::multiply) && program.nodes[node.arguments[1]].op == Op::constant;
}

// Constants that stand in a statement of their own.
std::vector<bool> constants_with_names(const Program& program) {
  std::vector<bool> named(program.nodes.size(), false);
  for (const Node& node : program.nodes) {
    const int with_name = takes_constant(program, node) ? 1 : arity(node.op);
    for (int i = 0; i < with_name; i++) named[node.arguments[std::size_t(i)]] = true;
  }
  for (const NodeId root : program.roots) named[root] = true;
  return named;
}

}  // namespace

std::string_view device_word(Op op) { return words[std::size_t(op)]; }

DeviceConstant device_constant(double value) {
  constexpr float least = std::numeric_limits<float>::min();
  if (value == 0) return {0, 0};
  if (std::abs(value) < double(least)) return {0, value > 0 ? 2 * least : -2 * least};
  const float rounded = float(value);
  if (!(std::abs(value) <= double(std::numeric_limits<float>::max())))
    throw Error(ErrorCode::input, fmt::format("the constant {} of an expression is too great for single precision, "
                                              "which reaches 3.4e38; scale the expression",
                                              value));
  if (double(rounded) == value) return {rounded, 0};
  const bool upwards = value > double(rounded);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float gap = std::abs(std::nextafter(rounded, upwards ? infinity : -infinity) - rounded);
  return {rounded, upwards ? std::max(gap, least) : -std::max(gap, least)};
}

std::string float_literal(float value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == text.npos) text += ".0";
  return text + "f";
}

std::string device_source(const Graph& graph, std::span<const NodeId> roots, std::string_view prefix,
                          std::vector<std::string>& names, const std::function<std::string(const Node&)>& decision) {
  const Program program = make_program(graph, roots);
  const std::vector<NodeId> ids = reachable(graph, roots);  // of the program's nodes, in the graph
  const std::vector<bool> named = constants_with_names(program);
  std::vector<NodeId> numbers(program.nodes.size());  // of statements, by node
  const auto name = [&](NodeId id) {
    const Node& node = program.nodes[id];
    return node.op == Op::variable ? fmt::format("v{}", int(node.value)) : fmt::format("{}n{}", prefix, numbers[id]);
  };

  std::string text;
  NodeId statements = 0;
  for (std::size_t id = 0; id < program.nodes.size(); id++) {
    const Node& node = program.nodes[id];
    if (node.op == Op::variable || (node.op == Op::constant && !named[id])) continue;
    numbers[id] = statements++;
    const bool constant = takes_constant(program, node);
    const std::string decided = decision ? decision(graph[ids[id]]) : "";
    std::string arguments = decided;
    const auto add = [&](const std::string& argument) { arguments += (arguments.empty() ? "" : ", ") + argument; };
    for (int i = 0; i < (constant ? 1 : arity(node.op)); i++) add(name(node.arguments[std::size_t(i)]));
    std::string_view suffix = decided.empty() ? "" : "_BY";
    std::string_view word = words[std::size_t(node.op)];
    if (constant || node.op == Op::constant) {
      const DeviceConstant c = device_constant(constant ? program.nodes[node.arguments[1]].value : node.value);
      add(float_literal(c.value));
      if (c.way != 0) add(float_literal(c.way));
      if (constant) suffix = c.way != 0 ? "_INEXACT" : "_CONSTANT";
      if (!constant && c.way != 0) word = "INEXACT";
    }
    if (node.op == Op::power_integer) add(fmt::format("{}", int(node.value)));
    fmt::format_to(std::back_inserter(text), "    NUMBER {} = OP_{}{}({});\n", name(NodeId(id)), word, suffix,
                   arguments);
  }
  names.clear();
  for (const NodeId root : program.roots) names.push_back(name(root));
  return text;
}

std::string function_source(const Graph& graph, std::span<const NodeId> roots, std::string_view head,
                            std::string_view before, std::string_view after,
                            const std::function<std::string(const Node&)>& decision) {
  std::vector<std::string> names;
  std::string text = fmt::format("{} {{\n{}", head, before);
  text += device_source(graph, roots, "", names, decision);
  fmt::dynamic_format_arg_store<fmt::format_context> arguments;
  for (const std::string& name : names) arguments.push_back(name);
  return text + fmt::vformat(after, arguments) + "}\n";
}

}  // namespace smurf::expression
