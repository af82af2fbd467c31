#include "patches/expression_source.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "expression/evaluate.hpp"
#include "expression/interval.hpp"
#include "expression/parser.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using expression::Interval;
using expression::Op;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = 0x1p-24;  // of floats
constexpr double tiny = 0x1p-123;     // kernels/common/functions.inc: above all that is lost near 0

double magnitude(const Interval& a) { return std::max(std::abs(a.low), std::abs(a.high)); }
double least_magnitude(const Interval& a) { return a.low > 0 ? a.low : a.high < 0 ? -a.high : 0; }

// What a sub-expression is on a box: its range, whether it is smooth there, and by how much floats are off.
struct Bound {
  Interval range;
  double error = 0;
  bool smooth = true;
};

// Errors of operations on floats: those stated in kernels/common/functions.inc, in roundings of the result.
double roundings_of(Op op, double value) {
  switch (op) {
    case Op::sqrt:
    case Op::atan:
      return 10;
    case Op::exp:
    case Op::log:
      return 3;
    case Op::sin:
    case Op::cos:
    case Op::sinh:
    case Op::divide:
      return 5;
    case Op::tan:
      return 12;
    case Op::asin:
      return 18;
    case Op::acos:
    case Op::atan2:
      return 14;
    case Op::cosh:
      return 6;
    case Op::tanh:
      return 8;
    case Op::power_integer:
      return std::abs(value) + 5;
    case Op::mod:
      return 4;
    case Op::add:
    case Op::subtract:
    case Op::multiply:
      return 1;
    default:
      return 0;
  }
}

// By how much the exact operation differs between exact arguments and those that floats have: Lipschitz's constant on
// the box, times their errors. Where the constant is infinite but the function continuous, Hölder's.
double carried_error(Op op, double value, const Bound& a, const Bound& b, const Bound& c, const Bound& d,
                     const Interval& result) {
  const double size = magnitude(a.range) + a.error, other = magnitude(b.range) + b.error;
  const double least = least_magnitude(a.range) - a.error, other_least = least_magnitude(b.range) - b.error;
  switch (op) {
    case Op::negate:
    case Op::abs:
    case Op::atan:
      return a.error;
    case Op::sign:
      return least > 0 ? 0 : 2;
    case Op::floor:
      return std::floor(a.range.low - a.error) == std::floor(a.range.high + a.error) ? 0 : 1 + a.error;
    case Op::sqrt:
      return least > 0 ? std::min(std::sqrt(a.error), a.error / (2 * std::sqrt(least))) : std::sqrt(a.error);
    case Op::exp:
      return magnitude(result) * a.error * std::exp(a.error);
    case Op::log:
      return a.range.low > a.error ? a.error / (a.range.low - a.error) : infinity;
    case Op::sin:
    case Op::cos:
      return size < 8192 ? std::min(a.error, 2.0) : 2;  // FUNCTION_TRIG_LIMIT
    case Op::tan: {
      const Interval wide{a.range.low - a.error, a.range.high + a.error, true};
      const double steepest = magnitude(expression::apply(Op::tan, 0, wide, {}, {}, {}));
      return size < 8192 ? a.error * (1 + steepest * steepest) : infinity;
    }
    case Op::asin:
    case Op::acos: {
      const double greatest_sine = std::min(size, 1.0);
      // |acos(x) - acos(y)| <= pi/sqrt(2) sqrt|x - y|, with equality between -1 and 1.
      const double steep = a.error / std::sqrt((1 - greatest_sine) * (1 + greatest_sine));
      const double hoelder = std::numbers::pi / std::numbers::sqrt2 * std::sqrt(a.error);
      return greatest_sine < 1 ? std::min(steep, hoelder) : hoelder;
    }
    case Op::sinh:
      return a.error * std::cosh(size);
    case Op::cosh:
      return a.error * std::sinh(size);
    case Op::tanh:
      return std::min(a.error, 2.0);
    case Op::add:
    case Op::subtract:
      return a.error + b.error;
    case Op::multiply:
      return magnitude(a.range) * b.error + other * a.error;
    case Op::divide:
      return other_least > 0 ? (a.error + magnitude(result) * b.error) / other_least : infinity;
    case Op::power_integer: {
      const double n = std::abs(value);
      if (value > 0) return a.error * n * std::pow(size, n - 1);
      return least > 0 ? a.error * n * std::pow(least, -n - 1) : infinity;
    }
    case Op::pow: {
      // Computed as exp(b log a): the device's error grows with |b log a|; a^b |b log a| = |y log y| is at most 1/e
      // below 1, and greatest at the end above it.
      const double y = magnitude(result), own = y > 1 ? y * std::log(y) : 0;
      const double device = rounding * (5 * y + 6 * std::max(own, 1 / std::numbers::e));
      const bool constant = b.range.low == b.range.high && b.error == 0;
      if (constant && b.range.low >= 1 && a.range.low >= 0)
        return device + a.error * b.range.low * std::pow(size, b.range.low - 1);
      if (!(a.range.low - a.error > 0)) return infinity;
      const double from = a.range.low - a.error;
      const double steep = std::max(std::abs(std::log(from)), std::abs(std::log(size)));
      const double change = other * a.error / from + steep * b.error;
      return device + y * change * std::exp(change);
    }
    case Op::atan2: {
      // The gradient is as long as 1/r.
      const double nearest = std::hypot(std::max(least, 0.0), std::max(other_least, 0.0));
      return nearest > 0 ? std::hypot(a.error, b.error) / nearest : infinity;
    }
    case Op::min:
    case Op::max:
      return std::max(a.error, b.error);
    case Op::mod:
      return a.error + (size / std::max(other_least, 0.0) + 1) * (b.error + 2 * rounding * other);
    case Op::choose: {
      const bool first = a.range.high + a.error <= b.range.low - b.error;
      const bool second = a.range.low - a.error > b.range.high + b.error;
      if (first || second) return first ? c.error : d.error;
      const double apart =
          std::max(c.range.high, d.range.high) - std::min(c.range.low, d.range.low);  // of any two values
      return std::max(c.error, d.error) + apart;
    }
    default:
      return 0;
  }
}

// Whether the operation is smooth on the box, where its arguments are. What touches a crease at its border alone counts
// as smooth: all that is there lies on one side.
bool is_smooth(Op op, const Bound& a, const Bound& b) {
  const Interval &x = a.range, &y = b.range;
  switch (op) {
    case Op::abs:
    case Op::sign:
      return x.low >= 0 || x.high <= 0;
    case Op::floor:
      return std::floor(x.low) == std::floor(x.high);
    case Op::min:
    case Op::max:
      return x.high <= y.low || y.high <= x.low;
    case Op::choose:
      return x.high <= y.low || x.low >= y.high;
    case Op::mod: {
      const Interval quotient = expression::apply(Op::divide, 0, x, y, {}, {});
      return std::floor(quotient.low) == std::floor(quotient.high);
    }
    case Op::atan2:
      return !(x.low < 0 && x.high >= 0 && y.low < 0);
    default:
      return true;
  }
}

Bound bound_of(Op op, double value, const Bound& a, const Bound& b, const Bound& c, const Bound& d) {
  Bound result;
  result.range = expression::apply(op, value, a.range, b.range, c.range, d.range);
  if (!(result.range.low <= result.range.high)) result.range = {-infinity, infinity, false};
  if (op == Op::constant) {
    result.error = double(float(value)) == value ? 0 : rounding * std::abs(value);
    return result;
  }
  const int count = expression::arity(op);
  result.smooth = is_smooth(op, a, b) && a.smooth && (count < 2 || b.smooth) && (count < 4 || (c.smooth && d.smooth));
  const double carried = carried_error(op, value, a, b, c, d, result.range);
  result.error = carried + roundings_of(op, value) * rounding * (magnitude(result.range) + carried) + tiny;
  if (op == Op::negate || op == Op::abs || op == Op::min || op == Op::max || op == Op::choose) result.error = carried;
  if (!(result.error <= std::numeric_limits<double>::max())) result.error = infinity;
  return result;
}

// The values of a sub-expression where it is defined, and whether that is nowhere in the box.
struct Range {
  Interval values;
  bool nowhere = false;
};
Range range_of(Op op, double value, const Range& a, const Range& b, const Range& c, const Range& d) {
  Range result{expression::apply(op, value, a.values, b.values, c.values, d.values), false};
  if (!(result.values.low <= result.values.high)) result.values = {-infinity, infinity, false};
  const int count = expression::arity(op);
  const Interval& x = a.values;
  const bool outside = (op == Op::sqrt && x.high < 0) || (op == Op::log && x.high <= 0) ||
                       ((op == Op::asin || op == Op::acos) && (x.high < -1 || x.low > 1));
  result.nowhere = outside || (count > 0 && a.nowhere) || (count > 1 && b.nowhere);
  return result;
}

}  // namespace

ExpressionSource::ExpressionSource(const std::array<std::string, 3>& position, const ParameterBox& range,
                                   const Parameters& parameters)
    : range_(range) {
  const std::array<std::string, 2> variables{"u", "v"};
  for (std::size_t c = 0; c < 3; c++) {
    nodes_[c] = expression::parse(graph_, position[c], variables, parameters);
    nodes_[3 + c] = expression::derivative(graph_, nodes_[c], 0);
    nodes_[6 + c] = expression::derivative(graph_, nodes_[c], 1);
    nodes_[9 + c] = expression::derivative(graph_, nodes_[3 + c], 0);
    nodes_[12 + c] = expression::derivative(graph_, nodes_[3 + c], 1);
    nodes_[15 + c] = expression::derivative(graph_, nodes_[6 + c], 1);
  }
  all_ = expression::make_program(graph_, nodes_);
  position_ = expression::make_program(graph_, std::span(nodes_).first(3));
}

PatchPoint ExpressionSource::at(std::size_t, double u, double v) const {
  thread_local std::vector<double> scratch;
  std::array<double, 18> r;
  const std::array<double, 2> variables{u, v};
  expression::run_program(
      all_, [&](std::size_t i) { return variables[i]; },
      [](Op op, double value, double a, double b, double c, double d) {
        return expression::apply(op, value, a, b, c, d);
      },
      std::span<double>(r), scratch);
  const auto three = [&](std::size_t i) { return glm::dvec3(r[i], r[i + 1], r[i + 2]); };
  return {three(0), three(3), three(6), three(9), three(12), three(15)};
}

std::optional<PieceBounds> ExpressionSource::bounds(std::size_t, const ParameterBox& box) const {
  thread_local std::vector<Bound> scratch;
  std::array<Bound, 18> r;
  const auto variable = [&](std::size_t i) {
    const Interval range{box.lower[int(i)], box.upper[int(i)], true};
    return Bound{range, rounding * magnitude(range), true};
  };
  expression::run_program(all_, variable, bound_of, std::span<Bound>(r), scratch);
  for (const Bound& b : r) {
    if (!b.range.defined || !b.smooth || !std::isfinite(b.range.low) || !std::isfinite(b.range.high))
      return std::nullopt;
  }
  PieceBounds result;
  for (int c = 0; c < 3; c++) {
    const Bound& position = r[std::size_t(c)];
    if (!std::isfinite(position.error)) return std::nullopt;
    result.lower[c] = position.range.low;
    result.upper[c] = position.range.high;
    result.error[c] = position.error;
    result.uu[c] = magnitude(r[9 + std::size_t(c)].range);
    result.uv[c] = magnitude(r[12 + std::size_t(c)].range);
    result.vv[c] = magnitude(r[15 + std::size_t(c)].range);
  }
  return result;
}

std::optional<SpaceBox> ExpressionSource::positions(std::size_t, const ParameterBox& box) const {
  thread_local std::vector<Range> scratch;
  std::array<Range, 3> r;
  const auto variable = [&](std::size_t i) { return Range{{box.lower[int(i)], box.upper[int(i)], true}, false}; };
  expression::run_program(position_, variable, range_of, std::span<Range>(r), scratch);
  SpaceBox result;
  for (int c = 0; c < 3; c++) {
    const auto& [range, nowhere] = r[std::size_t(c)];
    if (nowhere) return SpaceBox{glm::dvec3(infinity), glm::dvec3(-infinity)};
    result.lower[c] = range.low;
    result.upper[c] = range.high;
  }
  for (int c = 0; c < 3; c++) {
    if (!std::isfinite(result.lower[c]) || !std::isfinite(result.upper[c])) return std::nullopt;
  }
  return result;
}

}  // namespace smurf
