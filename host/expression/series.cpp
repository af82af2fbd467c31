#include "expression/series.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "expression/interval.hpp"

namespace smurf::expression {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr Bound whole{-infinity, infinity};

// The neighbouring numbers. What is not a number has the infinite one: no bound.
double above(double v) {
  if (!(v < infinity)) return infinity;
  if (v == 0) return std::numeric_limits<double>::denorm_min();
  return std::bit_cast<double>(std::bit_cast<std::int64_t>(v) + (v > 0 ? 1 : -1));
}
double below(double v) { return -above(-v); }

bool is_zero(const Bound& a) { return a.low == 0 && a.high == 0; }
bool is_point(const Bound& a) { return a.low == a.high; }
Bound exactly(double v) { return {v, v}; }
Bound hull(const Bound& a, const Bound& b) { return {std::min(a.low, b.low), std::max(a.high, b.high)}; }

// An infinite bound stands for numbers without bound, not for infinity: times zero it is zero.
double times(double x, double y) { return x == 0 || y == 0 ? 0 : x * y; }

Bound square(const Bound& a) {
  const double least = a.contains_zero() ? 0 : std::min(std::abs(a.low), std::abs(a.high)), most = a.magnitude();
  return {least == 0 ? 0 : std::max(below(least * least), 0.0), most == 0 ? 0 : above(most * most)};
}

Bound bound_of(const Interval& a) { return {a.low, a.high}; }
Interval interval_of(const Bound& a) { return {a.low, a.high, true}; }

// Bounds by interval.hpp; not checked for being defined.
Interval value_of(Op op, const Bound& a, const Bound& b = {}, double value = 0) {
  const Interval result = apply(op, value, interval_of(a), interval_of(b), {}, {});
  return result.low <= result.high ? result : Interval{.defined = false};
}

Series constant(double v) {
  Series r;
  r.at[0] = exactly(v);
  return r;
}

Series with_flags_of(Series r, const Series& a) {
  r.defined = r.defined && a.defined;
  r.continuous = r.continuous && a.continuous;
  r.nowhere = r.nowhere || a.nowhere;
  return r;
}
Series with_flags_of(const Series& r, const Series& a, const Series& b) {
  return with_flags_of(with_flags_of(r, a), b);
}

// Of which only the value is known.
Series value_only(const Interval& value, const Series& a, const Series& b) {
  Series r;
  r.at.fill(whole);
  r.at[0] = bound_of(value);
  r.defined = value.defined;
  r.continuous = false;
  return with_flags_of(r, a, b);
}

Series sum(const Series& a, const Series& b) {
  Series r;
  for (std::size_t k = 0; k < r.at.size(); k++) r.at[k] = a.at[k] + b.at[k];
  return with_flags_of(r, a, b);
}

Series negative(Series a) {
  for (Bound& c : a.at) c = -c;
  return a;
}

Series product(const Series& a, const Series& b) {
  Series r;
  for (std::size_t k = 0; k < r.at.size(); k++) {
    for (std::size_t i = 0; i <= k; i++) r.at[k] = r.at[k] + a.at[i] * b.at[k - i];
  }
  return with_flags_of(r, a, b);
}

Series quotient(const Series& a, const Series& b) {
  Series r;
  r.defined = !b.at[0].contains_zero();
  r.continuous = r.defined;
  r.nowhere = is_zero(b.at[0]);
  for (std::size_t k = 0; k < r.at.size(); k++) {
    Bound rest = a.at[k];
    for (std::size_t i = 0; i < k; i++) rest = rest - r.at[i] * b.at[k - i];
    r.at[k] = r.defined ? rest / b.at[0] : whole;
  }
  return with_flags_of(r, a, b);
}

using Coefficients = std::array<Bound, series_order + 1>;

// g(u), of g's Taylor coefficients over the values of u (Faà di Bruno). `value` also says where g is defined.
Series chain(const Interval& value, const Coefficients& g, const Series& u) {
  const Bound &u1 = u.at[1], &u2 = u.at[2], &u3 = u.at[3], &u4 = u.at[4];
  const Bound two = exactly(2), three = exactly(3), u1_squared = square(u1);
  Series r;
  r.at[0] = bound_of(value);
  r.at[1] = g[1] * u1;
  r.at[2] = g[1] * u2 + g[2] * u1_squared;
  r.at[3] = g[1] * u3 + two * (g[2] * (u1 * u2)) + g[3] * (u1 * u1_squared);
  r.at[4] = g[1] * u4 + g[2] * (two * (u1 * u3) + square(u2)) + three * (g[3] * (u1_squared * u2)) +
            g[4] * square(u1_squared);
  r.defined = value.defined;
  r.continuous = value.defined;
  return with_flags_of(r, u);
}

// Taylor coefficients of functions g over u; the first is not needed. Each is without bounds where g has a singularity.

// u^n, of the lower powers: n(n-1).../k! u^(n-k).
Coefficients of_power_integer(const Bound& u, int n) {
  Coefficients g{};
  double factor = 1;
  for (int k = 1; k <= series_order && factor != 0; k++) {
    factor = factor * (n - k + 1) / k;  // binomials of |n| <= 1024 are exact in four steps
    const Interval power = value_of(Op::power_integer, u, {}, n - k);
    if (factor != 0) g[std::size_t(k)] = exactly(factor) * (power.defined ? bound_of(power) : whole);
  }
  return g;
}

// u^p of positive u, of its value.
Coefficients of_power(const Bound& u, double p, const Bound& value) {
  Coefficients g{};
  g[0] = value;
  for (int k = 1; k <= series_order; k++) {
    const Bound factor = (exactly(p) - exactly(k - 1)) / exactly(k);
    g[std::size_t(k)] = u.low > 0 ? factor * g[std::size_t(k) - 1] / u : whole;
  }
  return g;
}

Coefficients of_logarithm(const Bound& u) {
  Coefficients g{};
  if (u.low <= 0) {
    g.fill(whole);
    return g;
  }
  const Bound inverse = exactly(1) / u;
  Bound power = -exactly(1);
  for (int k = 1; k <= series_order; k++) {
    power = -(power * inverse);
    g[std::size_t(k)] = power / exactly(k);
  }
  return g;
}

// Of a function whose derivatives repeat with period four: g, g', g'', g'''.
Coefficients of_cycle(const std::array<Bound, 4>& derivatives) {
  Coefficients g{};
  double factorial = 1;
  for (int k = 0; k <= series_order; k++) {
    if (k > 0) factorial *= k;
    g[std::size_t(k)] = derivatives[std::size_t(k % 4)] / exactly(factorial);
  }
  return g;
}

// Of tan and tanh: g' = 1 + sign g².
Coefficients of_tangent(const Bound& value, int sign) {
  Coefficients g{};
  g[0] = value;
  for (std::size_t k = 0; k < series_order; k++) {
    Bound squared = k == 0 ? square(value) : Bound{};
    for (std::size_t i = 0; k > 0 && i <= k; i++) squared = squared + g[i] * g[k - i];
    Bound slope = sign > 0 ? squared : -squared;
    if (k == 0) slope = slope + exactly(1);
    g[k + 1] = slope / exactly(double(k + 1));
  }
  return g;
}

// Of a function whose derivative is v^p, where v = v_0 + v_1 s + v_2 s² > 0: k v_0 q_k = sum of (p j - (k-j)) v_j
// q_{k-j}.
Coefficients of_derivative_power(const std::array<Bound, 3>& v, double p, const Bound& first) {
  Coefficients g{};
  if (v[0].low <= 0) {
    g.fill(whole);
    return g;
  }
  std::array<Bound, series_order> q{};
  q[0] = first;
  for (int k = 1; k < series_order; k++) {
    Bound rest;
    for (int j = 1; j <= std::min(k, 2); j++)
      rest = rest + exactly(p * j - (k - j)) * (v[std::size_t(j)] * q[std::size_t(k - j)]);
    q[std::size_t(k)] = rest / (exactly(k) * v[0]);
  }
  for (std::size_t k = 0; k < series_order; k++) g[k + 1] = q[k] / exactly(double(k + 1));
  return g;
}

Coefficients of_arctangent(const Bound& u) {
  const Bound v = exactly(1) + square(u);
  return of_derivative_power({v, exactly(2) * u, exactly(1)}, -1, exactly(1) / v);
}

Coefficients of_arcsine(const Bound& u) {
  const Bound v = (exactly(1) - u) * (exactly(1) + u);
  if (v.low <= 0) return of_derivative_power({v}, 0, v);
  const Bound root = bound_of(value_of(Op::sqrt, v));
  return of_derivative_power({v, exactly(-2) * u, exactly(-1)}, -0.5, exactly(1) / root);
}

Coefficients negated(Coefficients g) {
  for (Bound& c : g) c = -c;
  return g;
}

Series elementary(Op op, const Series& u) {
  const Bound& at = u.at[0];
  const Interval value = value_of(op, at);
  const Bound g = bound_of(value);
  const auto other = [&](Op of) { return bound_of(value_of(of, at)); };
  switch (op) {
    case Op::exp:
      return chain(value, of_cycle({g, g, g, g}), u);
    case Op::sin: {
      const Bound cosine = other(Op::cos);
      return chain(value, of_cycle({g, cosine, -g, -cosine}), u);
    }
    case Op::cos: {
      const Bound sine = other(Op::sin);
      return chain(value, of_cycle({g, -sine, -g, sine}), u);
    }
    case Op::sinh: {
      const Bound cosine = other(Op::cosh);
      return chain(value, of_cycle({g, cosine, g, cosine}), u);
    }
    case Op::cosh: {
      const Bound sine = other(Op::sinh);
      return chain(value, of_cycle({g, sine, g, sine}), u);
    }
    case Op::tan:
      return chain(value, of_tangent(g, 1), u);
    case Op::tanh:
      return chain(value, of_tangent(g, -1), u);
    case Op::atan:
      return chain(value, of_arctangent(at), u);
    case Op::asin:
      return chain(value, of_arcsine(at), u);
    case Op::acos:
      return chain(value, negated(of_arcsine(at)), u);
    case Op::sqrt:
      return chain(value, of_power(at, 0.5, g), u);
    case Op::log:
      return chain(value, of_logarithm(at), u);
    default:
      return value_only(value, u, u);
  }
}

// Defined nowhere, by the bounds of the arguments.
bool defined_nowhere(Op op, const Series& a) {
  const Bound& u = a.at[0];
  if (op == Op::sqrt) return u.high < 0;
  if (op == Op::log) return u.high <= 0;
  if (op == Op::asin || op == Op::acos) return u.low > 1 || u.high < -1;
  return false;
}

Series power(const Series& a, const Series& b) {
  const Interval value = value_of(Op::pow, a.at[0], b.at[0]);
  const bool constant_exponent = is_point(b.at[0]) && std::ranges::all_of(std::span(b.at).subspan(1), is_zero);
  if (constant_exponent) {
    const double p = b.at[0].low;
    if (std::floor(p) == p && std::abs(p) <= largest_integer_exponent)
      return with_flags_of(chain(value, of_power_integer(a.at[0], int(p)), a), b);
    Series r = with_flags_of(chain(value, of_power(a.at[0], p, bound_of(value)), a), b);
    r.nowhere = r.nowhere || (a.at[0].high < 0 && std::floor(p) != p);
    return r;
  }
  if (!(a.at[0].low > 0)) return value_only(value, a, b);
  return elementary(Op::exp, product(b, elementary(Op::log, a)));
}

// Of the slope (x y' - y x')/(x² + y²).
Series arctangent2(const Series& y, const Series& x) {
  const Interval value = value_of(Op::atan2, y.at[0], x.at[0]);
  const bool cut = y.at[0].low < 0 && y.at[0].high >= 0 && x.at[0].low < 0;
  if (cut || !value.defined) return value_only(value, x, y);
  const auto slope = [](const Series& a) {
    Series r = a;
    for (std::size_t k = 0; k < series_order; k++) r.at[k] = exactly(double(k + 1)) * a.at[k + 1];
    r.at[series_order] = whole;
    return r;
  };
  const auto squared = [](const Series& a) {
    return chain(value_of(Op::power_integer, a.at[0], {}, 2), of_power_integer(a.at[0], 2), a);
  };
  const Series turn = quotient(sum(product(x, slope(y)), negative(product(y, slope(x)))), sum(squared(x), squared(y)));
  Series r;
  r.at[0] = bound_of(value);
  for (std::size_t k = 0; k < series_order; k++) r.at[k + 1] = turn.at[k] / exactly(double(k + 1));
  return with_flags_of(r, x, y);
}

// Either of two, with a crease between them.
Series crease(const Bound& value, const Series& a, const Series& b) {
  Series r;
  r.at.fill(whole);
  r.at[0] = value;
  r.at[1] = hull(a.at[1], b.at[1]);
  return with_flags_of(r, a, b);
}

Series minimum(const Series& a, const Series& b) {
  if (a.at[0].high <= b.at[0].low) return with_flags_of(a, b);
  if (b.at[0].high <= a.at[0].low) return with_flags_of(b, a);
  return crease({std::min(a.at[0].low, b.at[0].low), std::min(a.at[0].high, b.at[0].high)}, a, b);
}

Series absolute(const Series& a) {
  if (a.at[0].low >= 0) return a;
  if (a.at[0].high <= 0) return negative(a);
  return crease({0, a.at[0].magnitude()}, a, negative(a));
}

// A step function: constant where its value is decided.
Series step(Op op, const Series& a) {
  const Interval value = value_of(op, a.at[0]);
  if (value.low == value.high && std::isfinite(value.low)) return with_flags_of(constant(value.low), a);
  return value_only(value, a, a);
}

Series modulo(const Series& a, const Series& b) {
  const Bound q = a.at[0] / b.at[0];
  if (!b.at[0].contains_zero() && q.is_finite() && std::floor(q.low) == std::floor(q.high))
    return sum(a, negative(product(constant(std::floor(q.low)), b)));
  Series r = value_only(value_of(Op::mod, a.at[0], b.at[0]), a, b);
  r.nowhere = r.nowhere || is_zero(b.at[0]);
  return r;
}

Series choose(const Series& a, const Series& b, const Series& c, const Series& d) {
  const bool first = a.at[0].high <= b.at[0].low, second = a.at[0].low > b.at[0].high;
  if (first || second) return with_flags_of(first ? c : d, a, b);
  const Bound either = hull(c.at[0], d.at[0]);
  Series r = with_flags_of(value_only({either.low, either.high, true}, a, b), c, d);
  r.nowhere = a.nowhere || b.nowhere || (c.nowhere && d.nowhere);
  return r;
}

}  // namespace

bool Bound::is_finite() const { return low > -infinity && high < infinity; }
double Bound::magnitude() const { return std::max(std::abs(low), std::abs(high)); }

Bound operator+(const Bound& a, const Bound& b) {
  if (is_zero(a)) return b;
  if (is_zero(b)) return a;
  return {below(a.low + b.low), above(a.high + b.high)};  // where infinities meet, there is no bound
}
Bound operator-(const Bound& a) { return {-a.high, -a.low}; }
Bound operator-(const Bound& a, const Bound& b) { return a + -b; }

Bound operator*(const Bound& a, const Bound& b) {
  if (is_zero(a) || is_zero(b)) return {};
  const double p = times(a.low, b.low), q = times(a.low, b.high), r = times(a.high, b.low), s = times(a.high, b.high);
  const double low = below(std::min(std::min(p, q), std::min(r, s)));
  const double high = above(std::max(std::max(p, q), std::max(r, s)));
  // Rounding does not take a result across zero where the signs leave no choice.
  const bool alike = (a.low >= 0 && b.low >= 0) || (a.high <= 0 && b.high <= 0);
  const bool opposed = (a.low >= 0 && b.high <= 0) || (a.high <= 0 && b.low >= 0);
  return {alike ? std::max(low, 0.0) : low, opposed ? std::min(high, 0.0) : high};
}

Bound operator/(const Bound& a, const Bound& b) {
  if (is_zero(a) && !b.contains_zero()) return {};
  const Interval q = value_of(Op::divide, a, b);
  return q.defined ? bound_of(q) : whole;
}

// clang-format off
Series apply(Op op, double value, const Series& a, const Series& b, const Series& c, const Series& d) {
  switch (op) {
    case Op::constant: return constant(value);
    case Op::variable: return value_only({.defined = false}, a, a);
    case Op::negate: return negative(a);
    case Op::abs: return absolute(a);
    case Op::sign:
    case Op::floor: return step(op, a);
    case Op::add: return sum(a, b);
    case Op::subtract: return sum(a, negative(b));
    case Op::multiply: return product(a, b);
    case Op::divide: return quotient(a, b);
    case Op::power_integer:
      return chain(value_of(op, a.at[0], {}, value), of_power_integer(a.at[0], int(value)), a);
    case Op::pow: return power(a, b);
    case Op::atan2: return arctangent2(a, b);
    case Op::min: return minimum(a, b);
    case Op::max: return negative(minimum(negative(a), negative(b)));
    case Op::mod: return modulo(a, b);
    case Op::choose: return choose(a, b, c, d);
    default: break;
  }
  Series r = elementary(op, a);
  r.nowhere = r.nowhere || defined_nowhere(op, a);
  return r;
}
// clang-format on

namespace {

// Cuts the values to what the slope allows from the middle on.
void cut_by_slope(Series& over, const Series& middle) {
  if (!over.defined || !over.continuous || !middle.defined) return;
  const Bound reach = middle.at[0] + over.at[1] * Bound{-1, 1};
  over.at[0] = {std::max(over.at[0].low, reach.low), std::min(over.at[0].high, reach.high)};
}

}  // namespace

Series evaluate(const Program& program, std::span<const Series> variables, std::span<const Series> middle,
                std::vector<Series>& nodes) {
  require_fitting(program, variables.size(), 1);
  nodes.resize(program.nodes.size());
  for (std::size_t i = 0; i < program.nodes.size(); i++) {
    const Node& node = program.nodes[i];
    const auto& from = node.arguments;
    nodes[i] = node.op == Op::variable
                   ? variables[std::size_t(node.value)]
                   : apply(node.op, node.value, nodes[from[0]], nodes[from[1]], nodes[from[2]], nodes[from[3]]);
    if (!middle.empty()) cut_by_slope(nodes[i], middle[i]);
  }
  return nodes[program.roots[0]];
}

Series evaluate(const Program& program, std::span<const Series> variables, std::vector<Series>& nodes) {
  return evaluate(program, variables, {}, nodes);
}

}  // namespace smurf::expression
