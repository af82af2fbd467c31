#include "expression/graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "expression/evaluate.hpp"
#include "smurf/error.hpp"

namespace smurf::expression {
namespace {

constexpr std::size_t most_nodes = std::size_t(1) << 28;  // 8 GiB of nodes

std::uint64_t mixed(std::uint64_t h) {  // the finalizer of splitmix64
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
  return h ^ (h >> 31);
}

std::uint64_t hash(const Node& node) {
  std::uint64_t h = mixed(std::bit_cast<std::uint64_t>(node.value) + 0x9e3779b97f4a7c15u * (1 + unsigned(node.op)));
  for (const NodeId a : node.arguments) h = mixed(h + 0x9e3779b97f4a7c15u + a);
  return h;
}

bool is_commutative(Op op) { return op == Op::add || op == Op::multiply || op == Op::min || op == Op::max; }

bool is_small_integer(double value) {
  return std::floor(value) == value && std::abs(value) <= largest_integer_exponent;
}

}  // namespace

int arity(Op op) {
  if (op <= Op::variable) return 0;
  if (op == Op::power_integer || op < Op::add) return 1;
  return op == Op::choose ? 4 : 2;
}

// ---- Building

NodeId Graph::constant(double value) {
  if (!std::isfinite(value)) throw Error(ErrorCode::input, "a constant of an expression is infinite or no number");
  return intern({Op::constant, value == 0 ? 0.0 : value, {}});  // one zero
}

NodeId Graph::variable(int index) {
  if (index < 0) throw Error(ErrorCode::usage, "a variable of an expression has a negative index");
  return intern({Op::variable, double(index), {}});
}

NodeId Graph::unary(Op op, NodeId a) {
  if (arity(op) != 1 || op == Op::power_integer)
    throw Error(ErrorCode::usage, "an operation of an expression was given one argument, but takes another number");
  const Node inner = nodes_[a];  // a copy: building moves the nodes
  if (op == Op::negate && inner.op == Op::negate) return inner.arguments[0];
  if (op == Op::negate && inner.op == Op::subtract) return subtract(inner.arguments[1], inner.arguments[0]);
  if (op == Op::negate && inner.op == Op::multiply && is_constant(inner.arguments[1]))
    return multiply(inner.arguments[0], constant(-nodes_[inner.arguments[1]].value));
  if (op == Op::abs && inner.op == Op::abs) return a;
  if (op == Op::abs && inner.op == Op::negate) return unary(Op::abs, inner.arguments[0]);  // one level
  return folded_or_interned({op, 0, {a}});
}

NodeId Graph::binary(Op op, NodeId a, NodeId b) {
  if (arity(op) != 2)
    throw Error(ErrorCode::usage, "an operation of an expression was given two arguments, but takes another number");
  // Constants stand second; else the order of building decides.
  if (is_commutative(op) && std::pair(is_constant(b), b) < std::pair(is_constant(a), a)) std::swap(a, b);
  if (!(is_constant(a) && is_constant(b))) switch (op) {
      case Op::add:
        return sum(a, b);
      case Op::subtract:
        return difference(a, b);
      case Op::multiply:
        return product(a, b);
      case Op::divide:
        return quotient(a, b);
      case Op::pow:
        return general_power(a, b);
      case Op::min:
      case Op::max:
        if (a == b) return a;
        break;
      default:
        break;
    }
  return folded_or_interned({op, 0, {a, b}});
}

NodeId Graph::sum(NodeId a, NodeId b) {
  if (is_constant(b, 0)) return a;
  if (nodes_[b].op == Op::negate) return subtract(a, nodes_[b].arguments[0]);
  if (nodes_[a].op == Op::negate) return subtract(b, nodes_[a].arguments[0]);
  if (a == b) return multiply(a, constant(2));
  return intern({Op::add, 0, {a, b}});
}

NodeId Graph::difference(NodeId a, NodeId b) {
  if (is_constant(b)) return add(a, constant(-nodes_[b].value));
  if (is_constant(a, 0)) return negate(b);
  if (nodes_[b].op == Op::negate) return add(a, nodes_[b].arguments[0]);
  if (a == b && is_total(a)) return constant(0);
  return intern({Op::subtract, 0, {a, b}});
}

NodeId Graph::product(NodeId a, NodeId b) {
  if (is_constant(b, 0) && is_total(a)) return b;
  if (is_constant(b, 1)) return a;
  if (is_constant(b, -1)) return negate(a);
  if (is_constant(b)) {
    const Node inner = nodes_[a];  // a copy: building moves the nodes
    if (inner.op == Op::negate) return multiply(inner.arguments[0], constant(-nodes_[b].value));
    if (inner.op == Op::multiply && is_constant(inner.arguments[1])) {
      const double both = nodes_[inner.arguments[1]].value * nodes_[b].value;
      if (std::isnormal(both)) return multiply(inner.arguments[0], constant(both));
    }
  }
  // Powers of one base; with positive exponents they are defined where the base is.
  const auto base_and_exponent = [&](NodeId id) {
    const Node& node = nodes_[id];
    const bool power = node.op == Op::power_integer && node.value > 0;
    return power ? std::pair(node.arguments[0], int(node.value)) : std::pair(id, 1);
  };
  const auto [base, exponent] = base_and_exponent(a);
  const auto [other_base, other_exponent] = base_and_exponent(b);
  if (base == other_base && exponent + other_exponent <= largest_integer_exponent)
    return power(base, exponent + other_exponent);
  return intern({Op::multiply, 0, {a, b}});
}

NodeId Graph::quotient(NodeId a, NodeId b) {
  if (is_constant(b, 1)) return a;
  if (is_constant(b, -1)) return negate(a);
  return intern({Op::divide, 0, {a, b}});
}

NodeId Graph::general_power(NodeId a, NodeId b) {
  if (is_constant(b) && is_small_integer(nodes_[b].value)) return power(a, int(nodes_[b].value));
  if (is_constant(b, 0.5)) return unary(Op::sqrt, a);
  return intern({Op::pow, 0, {a, b}});
}

NodeId Graph::power(NodeId a, int exponent) {
  if (std::abs(exponent) > largest_integer_exponent) return binary(Op::pow, a, constant(exponent));
  if (exponent == 1) return a;
  if (exponent == 0 && is_total(a)) return constant(1);
  const Node inner = nodes_[a];  // a copy: building moves the nodes
  if (inner.op == Op::power_integer && inner.value > 0 && exponent > 0 &&
      inner.value * exponent <= largest_integer_exponent)
    return power(inner.arguments[0], int(inner.value) * exponent);  // one level: the inner base is no such power
  return folded_or_interned({Op::power_integer, double(exponent), {a}});
}

NodeId Graph::choose(NodeId a, NodeId b, NodeId c, NodeId d) {
  if (is_constant(a) && is_constant(b)) return nodes_[a].value <= nodes_[b].value ? c : d;
  if (c == d && is_total(a) && is_total(b)) return c;
  return intern({Op::choose, 0, {a, b, c, d}});
}

// Constants where all arguments are and the result is finite: what is undefined must stay so.
NodeId Graph::folded_or_interned(const Node& node) {
  std::array<double, 4> values{};
  for (int i = 0; i < arity(node.op); i++) {
    if (!is_constant(node.arguments[std::size_t(i)])) return intern(node);
    values[std::size_t(i)] = nodes_[node.arguments[std::size_t(i)]].value;
  }
  const double result = apply(node.op, node.value, values[0], values[1], values[2], values[3]);
  return std::isfinite(result) ? constant(result) : intern(node);
}

bool Graph::total_by_construction(const Node& node) const {
  for (int i = 0; i < arity(node.op); i++)
    if (!total_[node.arguments[std::size_t(i)]]) return false;
  switch (node.op) {
    case Op::sqrt:
    case Op::exp:  // these three are defined everywhere, but overflow early
    case Op::sinh:
    case Op::cosh:
    case Op::log:
    case Op::tan:
    case Op::asin:
    case Op::acos:
    case Op::pow:
    case Op::atan2:
    case Op::mod:
      return false;
    case Op::divide:
      return is_constant(node.arguments[1]) && !is_constant(node.arguments[1], 0);
    case Op::power_integer:
      return node.value >= 0;
    default:
      return true;
  }
}

NodeId Graph::intern(const Node& node) {
  if (2 * (nodes_.size() + 1) > table_.size()) grow_table();
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = hash(node) & mask;
  for (; table_[slot] != 0; slot = (slot + 1) & mask)
    if (nodes_[table_[slot] - 1] == node) return table_[slot] - 1;
  if (nodes_.size() >= most_nodes)
    throw Error(ErrorCode::memory, "an expression has grown beyond 268435456 operations");
  const bool total = total_by_construction(node);
  nodes_.push_back(node);
  total_.push_back(total);
  table_[slot] = NodeId(nodes_.size());
  return NodeId(nodes_.size() - 1);
}

void Graph::grow_table() {
  table_.assign(std::max<std::size_t>(64, 2 * table_.size()), 0);
  const std::size_t mask = table_.size() - 1;
  for (std::size_t i = 0; i < nodes_.size(); i++) {
    std::size_t slot = hash(nodes_[i]) & mask;
    while (table_[slot] != 0) slot = (slot + 1) & mask;
    table_[slot] = NodeId(i + 1);
  }
}

// ---- Derivatives

namespace {

// Products and quotients in derivatives: a vanishing derivative takes its whole term along, even if the other factor
// is not total, for where that is undefined, the function itself is.
class Rules {
 public:
  explicit Rules(Graph& graph) : g_(graph), zero_(graph.constant(0)) {}

  // clang-format off
  // Of `node`, which is `id`, given the derivatives of its arguments.
  NodeId operator()(NodeId id, const Node& node, const std::array<NodeId, 4>& slopes) {
    const auto [a, b, c, d] = node.arguments;
    const auto [da, db, dc, dd] = slopes;
    if (slopes == std::array{zero_, zero_, zero_, zero_}) return zero_;
    switch (node.op) {
      case Op::constant:
      case Op::variable:  // the caller knows which variable is meant
      case Op::sign:
      case Op::floor: return zero_;
      case Op::negate: return g_.negate(da);
      case Op::abs: return times(da, slope_of_absolute(a));
      case Op::sqrt: return over(da, g_.multiply(id, g_.constant(2)));
      case Op::exp: return times(da, id);
      case Op::log: return over(da, a);
      case Op::sin: return times(da, g_.unary(Op::cos, a));
      case Op::cos: return times(da, g_.negate(g_.unary(Op::sin, a)));
      case Op::tan: return times(da, g_.add(g_.power(id, 2), g_.constant(1)));
      case Op::asin: return over(da, root_of_one_minus_square(a));
      case Op::acos: return g_.negate(over(da, root_of_one_minus_square(a)));
      case Op::atan: return over(da, g_.add(g_.power(a, 2), g_.constant(1)));
      case Op::sinh: return times(da, g_.unary(Op::cosh, a));
      case Op::cosh: return times(da, g_.unary(Op::sinh, a));
      case Op::tanh: return times(da, g_.subtract(g_.constant(1), g_.power(id, 2)));
      case Op::add: return g_.add(da, db);
      case Op::subtract: return g_.subtract(da, db);
      case Op::multiply: return g_.add(times(da, b), times(db, a));
      case Op::divide: return over(g_.subtract(da, times(db, id)), b);
      case Op::power_integer: return times(da, power_slope(id, a, int(node.value)));
      case Op::pow: return g_.add(by_base(a, b, da), by_exponent(id, a, db));
      case Op::atan2:
        return over(g_.subtract(times(da, b), times(db, a)),
                    g_.add(g_.power(a, 2), g_.power(b, 2)));
      case Op::min: return da == db ? da : g_.choose(a, b, da, db);
      case Op::max: return da == db ? da : g_.choose(b, a, da, db);
      case Op::mod: return g_.subtract(da, times(db, g_.unary(Op::floor, g_.divide(a, b))));
      case Op::choose: return dc == dd ? dc : g_.choose(a, b, dc, dd);
    }
    return zero_;
  }
  // clang-format on

 private:
  NodeId times(NodeId slope, NodeId factor) { return slope == zero_ ? zero_ : g_.multiply(factor, slope); }
  NodeId over(NodeId slope, NodeId divisor) { return slope == zero_ ? zero_ : g_.divide(slope, divisor); }

  // 1 at 0, where the sign of a would belong to neither side.
  NodeId slope_of_absolute(NodeId a) { return g_.choose(zero_, a, g_.constant(1), g_.constant(-1)); }
  NodeId root_of_one_minus_square(NodeId a) { return g_.unary(Op::sqrt, g_.subtract(g_.constant(1), g_.power(a, 2))); }
  // n a^(n-1); of the least exponent there is no lesser.
  NodeId power_slope(NodeId id, NodeId a, int n) {
    if (n == 0) return zero_;
    return g_.multiply(n == -largest_integer_exponent ? g_.divide(id, a) : g_.power(a, n - 1), g_.constant(n));
  }
  NodeId by_base(NodeId a, NodeId b, NodeId da) {
    return times(da, g_.multiply(b, g_.binary(Op::pow, a, g_.subtract(b, g_.constant(1)))));
  }
  NodeId by_exponent(NodeId id, NodeId a, NodeId db) { return times(db, g_.multiply(id, g_.unary(Op::log, a))); }

  Graph& g_;
  const NodeId zero_;
};

}  // namespace

NodeId derivative(Graph& graph, NodeId f, int variable) {
  const std::vector<NodeId> order = reachable(graph, std::span(&f, 1));
  Rules rules(graph);
  const NodeId zero = graph.constant(0);
  std::vector<NodeId> slopes(std::size_t(f) + 1, zero);  // by node
  for (const NodeId id : order) {
    const Node node = graph[id];  // a copy: the graph grows
    std::array<NodeId, 4> own{};
    for (std::size_t i = 0; i < own.size(); i++) own[i] = int(i) < arity(node.op) ? slopes[node.arguments[i]] : zero;
    slopes[id] = node.op == Op::variable && node.value == variable ? graph.constant(1) : rules(id, node, own);
  }
  return slopes[f];
}

// ---- Reading

std::vector<NodeId> reachable(const Graph& graph, std::span<const NodeId> roots) {
  if (roots.empty()) return {};
  std::vector<bool> wanted(std::size_t(*std::max_element(roots.begin(), roots.end())) + 1);
  for (const NodeId root : roots) wanted[root] = true;
  std::size_t count = 0;
  for (std::size_t id = wanted.size(); id-- > 0;) {
    if (!wanted[id]) continue;
    count++;
    const Node& node = graph[NodeId(id)];
    for (int i = 0; i < arity(node.op); i++) wanted[node.arguments[std::size_t(i)]] = true;
  }
  std::vector<NodeId> order;
  order.reserve(count);
  for (std::size_t id = 0; id < wanted.size(); id++)
    if (wanted[id]) order.push_back(NodeId(id));
  return order;
}

int polynomial_degree(const Graph& graph, NodeId f) {
  constexpr std::int64_t greatest = 1'000'000'000;
  std::vector<std::int64_t> degrees(std::size_t(f) + 1, -1);
  for (const NodeId id : reachable(graph, std::span(&f, 1))) {
    const Node& node = graph[id];
    const std::int64_t a = degrees[node.arguments[0]], b = degrees[node.arguments[1]];  // where there are such
    std::int64_t degree = -1;
    switch (node.op) {
      case Op::constant:
        degree = 0;
        break;
      case Op::variable:
        degree = 1;
        break;
      case Op::negate:
        degree = a;
        break;
      case Op::add:
      case Op::subtract:
        degree = a < 0 || b < 0 ? -1 : std::max(a, b);
        break;
      case Op::multiply:
        degree = a < 0 || b < 0 ? -1 : a + b;
        break;
      case Op::divide:
        degree = graph.is_constant(node.arguments[1]) && !graph.is_constant(node.arguments[1], 0) ? a : -1;
        break;
      case Op::power_integer:
        degree = a < 0 || node.value < 0 ? -1 : a * std::int64_t(node.value);
        break;
      default:
        break;
    }
    degrees[id] = std::min(degree, greatest);
  }
  return int(degrees[f]);
}

Program make_program(const Graph& graph, std::span<const NodeId> roots) {
  const std::vector<NodeId> order = reachable(graph, roots);
  std::vector<NodeId> places(order.empty() ? 0 : std::size_t(order.back()) + 1);
  Program program;
  program.nodes.reserve(order.size());
  for (const NodeId id : order) {
    Node node = graph[id];
    for (int i = 0; i < arity(node.op); i++) node.arguments[std::size_t(i)] = places[node.arguments[std::size_t(i)]];
    if (node.op == Op::variable) program.variables = std::max(program.variables, int(node.value) + 1);
    places[id] = NodeId(program.nodes.size());
    program.nodes.push_back(node);
  }
  for (const NodeId root : roots) program.roots.push_back(places[root]);
  return program;
}

void require_fitting(const Program& program, std::size_t variables, std::size_t results) {
  if (int(variables) >= program.variables && results == program.roots.size()) return;
  throw Error(ErrorCode::usage, fmt::format("an expression of {} variables and {} results was given {} and room for {}",
                                            program.variables, program.roots.size(), variables, results));
}

bool has_creases(const Graph& graph) {
  for (NodeId id = 0; id < graph.size(); id++) {
    switch (graph[id].op) {
      case Op::abs:
      case Op::sign:
      case Op::floor:
      case Op::min:
      case Op::max:
      case Op::mod:
      case Op::choose:
        return true;
      default:
        break;
    }
  }
  return false;
}

}  // namespace smurf::expression
