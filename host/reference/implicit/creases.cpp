#include "reference/implicit/creases.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "expression/interval.hpp"

namespace smurf {
namespace {

using expression::Interval;
using expression::Node;
using expression::Op;

constexpr double half_a_step = 0x1p-24;  // between floats, relative
Interval widened(const Interval& a) {
  const double reach = half_a_step * std::max(std::abs(a.low), std::abs(a.high));
  return {a.low - reach, a.high + reach, a.defined};
}

bool may_turn(const Node& node) { return node.op == Op::choose || node.op == Op::sign; }

bool is_open(const Node& node, const std::vector<Interval>& values) {
  const Interval& a = values[node.arguments[0]];
  if (node.op == Op::sign) return a.low <= 0 && a.high >= 0 && a.low < a.high;
  const Interval& b = values[node.arguments[1]];
  return a.low <= b.high && b.low <= a.high;
}

// As floats evaluate the operation.
Interval rounded(const Node& node, const Interval& result) {
  switch (node.op) {
    case Op::constant:
      return {std::min(result.low, double(float(result.low))), std::max(result.high, double(float(result.high)))};
    case Op::negate:
    case Op::abs:
    case Op::sign:
    case Op::floor:
    case Op::min:
    case Op::max:
    case Op::choose:
      return result;
    default:
      return widened(result);
  }
}

// The values of all nodes; what `open` says of a node goes either way.
template <class Open>
void evaluate(const expression::Program& program, const std::array<Interval, 3>& at, bool in_floats, const Open& open,
              std::vector<Interval>& values) {
  values.resize(program.nodes.size());
  for (std::size_t i = 0; i < program.nodes.size(); i++) {
    const Node& node = program.nodes[i];
    const Interval &a = values[node.arguments[0]], &b = values[node.arguments[1]], &c = values[node.arguments[2]],
                   &d = values[node.arguments[3]];
    if (node.op == Op::variable) {
      values[i] = at[std::size_t(node.value)];
    } else if (!may_turn(node) || !open(i)) {
      const Interval result = expression::apply(node.op, node.value, a, b, c, d);
      values[i] = in_floats ? rounded(node, result) : result;
    } else if (node.op == Op::sign) {
      values[i] = {-1, 1, a.defined};
    } else {
      values[i] = {std::min(c.low, d.low), std::max(c.high, d.high), a.defined && b.defined && c.defined && d.defined};
    }
  }
}

}  // namespace

SidesOfGradient::SidesOfGradient(const expression::Graph& graph, const std::array<expression::NodeId, 3>& gradient)
    : gradient_(expression::make_program(graph, gradient)), any_(std::ranges::any_of(gradient_.nodes, may_turn)) {}

double SidesOfGradient::apart(const glm::dvec3& point) const {
  if (!any_) return 0;
  thread_local std::vector<Interval> around, here;
  std::array<Interval, 3> places, exactly;
  for (int axis = 0; axis < 3; axis++) {
    exactly[std::size_t(axis)] = {point[axis], point[axis]};
    places[std::size_t(axis)] = widened(exactly[std::size_t(axis)]);
  }
  const auto open = [&](std::size_t i) { return is_open(gradient_.nodes[i], around); };
  evaluate(gradient_, places, true, open, around);
  // At the point itself: what remains of widths is the sides.
  evaluate(gradient_, exactly, false, open, here);
  double most = 0;
  for (const expression::NodeId root : gradient_.roots) {
    const Interval& slope = here[root];
    if (!slope.defined || !std::isfinite(slope.high - slope.low)) return 0;
    most = std::max(most, slope.high - slope.low);
  }
  return most;
}

std::size_t SidesOfGradient::bytes() const { return gradient_.nodes.size() * sizeof(Node); }

}  // namespace smurf
