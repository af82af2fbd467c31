// Expressions as a graph: every sub-expression stands once, after those it is made of. Nothing here recurses, so that
// a graph may be as deep as memory allows.
//
// Building simplifies, but never so that a function becomes defined where it was not: 0*log(x) stays, 0*sin(x) is 0.
// What simplification may change is the last bits of a result, and the sign of a zero.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace smurf::expression {

enum class Op : std::uint8_t {
  constant,
  variable,
  negate,
  abs,
  sign,  // -1, 0 or 1
  floor,
  sqrt,
  exp,
  log,
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  sinh,
  cosh,
  tanh,
  add,
  subtract,
  multiply,
  divide,
  power_integer,  // a^n, n in Node::value, |n| <= 1024
  pow,            // a^b; of negative a only where b happens to be an integer
  atan2,          // atan2(a, b)
  min,
  max,
  mod,     // a - b*floor(a/b)
  choose,  // a <= b ? c : d; where a and b are defined, the one of c and d that is not chosen does not matter
};
constexpr int operation_count = int(Op::choose) + 1;

// The number of sub-expressions that an operation takes.
int arity(Op);

using NodeId = std::uint32_t;

struct Node {
  Op op = Op::constant;
  double value = 0;  // of a constant; the index of a variable; an integer exponent
  std::array<NodeId, 4> arguments{};

  bool operator==(const Node&) const = default;
};

constexpr int largest_integer_exponent = 1024;

class Graph {
 public:
  NodeId constant(double value);  // must be finite
  NodeId variable(int index);
  NodeId unary(Op op, NodeId a);
  NodeId binary(Op op, NodeId a, NodeId b);
  NodeId power(NodeId a, int exponent);
  NodeId choose(NodeId a, NodeId b, NodeId c, NodeId d);

  NodeId negate(NodeId a) { return unary(Op::negate, a); }
  NodeId add(NodeId a, NodeId b) { return binary(Op::add, a, b); }
  NodeId subtract(NodeId a, NodeId b) { return binary(Op::subtract, a, b); }
  NodeId multiply(NodeId a, NodeId b) { return binary(Op::multiply, a, b); }
  NodeId divide(NodeId a, NodeId b) { return binary(Op::divide, a, b); }

  const Node& operator[](NodeId id) const { return nodes_[id]; }
  std::size_t size() const { return nodes_.size(); }
  bool is_constant(NodeId id) const { return nodes_[id].op == Op::constant; }
  bool is_constant(NodeId id, double value) const { return is_constant(id) && nodes_[id].value == value; }
  // Whether the expression is known to be defined everywhere.
  bool is_total(NodeId id) const { return total_[id]; }

 private:
  NodeId intern(const Node& node);
  NodeId folded_or_interned(const Node& node);
  bool total_by_construction(const Node& node) const;
  void grow_table();
  NodeId sum(NodeId a, NodeId b);
  NodeId difference(NodeId a, NodeId b);
  NodeId product(NodeId a, NodeId b);
  NodeId quotient(NodeId a, NodeId b);
  NodeId general_power(NodeId a, NodeId b);

  std::vector<Node> nodes_;
  std::vector<bool> total_;
  std::vector<NodeId> table_;  // open addressing; a node's id + 1, or 0
};

// The derivative by one variable, exact. It is taken to be undefined where f is, though it may have a value there.
// At creases it is the derivative of one side: that of a in min(a, b), max(a, b) where a = b, and |a|' = a' where
// a = 0; at the steps of floor and sign it is 0. That of a^b with an exponent that is no constant needs a > 0.
NodeId derivative(Graph& graph, NodeId f, int variable);

// All that the roots are made of, each after its arguments.
std::vector<NodeId> reachable(const Graph& graph, std::span<const NodeId> roots);

// The total degree of an expression that is a polynomial as it is written (cancellation is not looked for), -1 of
// any other. Degrees beyond 10^9 are given as 10^9.
int polynomial_degree(const Graph& graph, NodeId f);

// What is reachable, numbered densely in the same order, and without the graph.
struct Program {
  std::vector<Node> nodes;
  std::vector<NodeId> roots;
  int variables = 0;  // the greatest index of a variable, plus one
};
Program make_program(const Graph& graph, std::span<const NodeId> roots);

// Throws Error (usage) when there are too few variables, or not one result per root.
void require_fitting(const Program& program, std::size_t variables, std::size_t results);

// Runs a program on numbers of any kind: values[i] becomes variable(index), or what apply(op, value, a, b, c, d) makes
// of its arguments.
template <class Number, class Variable, class Apply>
void run_program(const Program& program, const Variable& variable, const Apply& apply, std::span<Number> results,
                 std::vector<Number>& values) {
  values.resize(program.nodes.size());
  for (std::size_t i = 0; i < program.nodes.size(); i++) {
    const Node& node = program.nodes[i];
    const auto& from = node.arguments;
    values[i] = node.op == Op::variable
                    ? variable(std::size_t(node.value))
                    : apply(node.op, node.value, values[from[0]], values[from[1]], values[from[2]], values[from[3]]);
  }
  for (std::size_t i = 0; i < results.size(); i++) results[i] = values[program.roots[i]];
}

// Whether derivatives may jump where the function is defined.
bool has_creases(const Graph& graph);

}  // namespace smurf::expression
