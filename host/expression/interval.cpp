#include "expression/interval.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "expression/evaluate.hpp"

namespace smurf::expression {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double pi = std::numbers::pi;

// The GNU C library states at most 2 units in the last place for what is used here; others are no worse than twice
// that.
constexpr int library_steps = 4;

double down(double v, int steps = 1) {
  while (steps-- > 0) v = std::nextafter(v, -infinity);
  return v;
}
double up(double v, int steps = 1) {
  while (steps-- > 0) v = std::nextafter(v, infinity);
  return v;
}

const Interval whole_undefined{-infinity, infinity, false};

Interval outward(double low, double high, bool defined, int steps = 1) {
  if (std::isnan(low) || std::isnan(high)) return {-infinity, infinity, defined};
  return {down(low, steps), up(high, steps), defined};
}

Interval clipped(Interval i, double least, double greatest) {
  return {std::clamp(i.low, least, greatest), std::clamp(i.high, least, greatest), i.defined};
}

template <class F>
Interval monotone(F f, const Interval& a) {
  return outward(f(a.low), f(a.high), a.defined, library_steps);
}

Interval magnitude(const Interval& a) {
  if (a.low >= 0) return a;
  if (a.high <= 0) return {-a.high, -a.low, a.defined};
  return {0, std::max(-a.low, a.high), a.defined};
}

Interval sum(const Interval& a, const Interval& b) {
  const double low = a.low + b.low, high = a.high + b.high;  // where infinities meet, there is no bound
  const bool defined = a.defined && b.defined;
  return {std::isnan(low) ? -infinity
          : low == 0      ? 0
                          : down(low),
          std::isnan(high) ? infinity
          : high == 0      ? 0
                           : up(high),
          defined};
}

Interval negative(const Interval& a) { return {-a.high, -a.low, a.defined}; }

// An infinite bound stands for numbers without bound, not for infinity: times zero it is zero.
Interval product(const Interval& a, const Interval& b) {
  Interval result{infinity, -infinity, a.defined && b.defined};
  for (const double x : {a.low, a.high})
    for (const double y : {b.low, b.high}) {
      const bool zero = x == 0 || y == 0;  // exactly
      result.low = std::min(result.low, zero ? 0 : down(x * y));
      result.high = std::max(result.high, zero ? 0 : up(x * y));
    }
  return result;
}

Interval quotient(const Interval& a, const Interval& b) {
  if (b.low <= 0 && b.high >= 0) return whole_undefined;
  Interval result{infinity, -infinity, a.defined && b.defined};
  for (const double x : {a.low, a.high})
    for (const double y : {b.low, b.high}) {
      // Infinity by infinity may be anything of its sign.
      const double q = x / y;
      const bool positive = (x > 0) == (y > 0);
      result.low = std::min(result.low, x == 0 ? 0 : std::isnan(q) ? (positive ? 0 : -infinity) : down(q));
      result.high = std::max(result.high, x == 0 ? 0 : std::isnan(q) ? (positive ? infinity : 0) : up(q));
    }
  return result;
}

// Whether phase + k*period is in the interval for some integer k; may say yes when it is only close.
bool may_reach(const Interval& a, double phase, double period) {
  const double first = (a.low - phase) / period, last = (a.high - phase) / period;
  const double slack = 4 * epsilon * (1 + std::max(std::abs(first), std::abs(last)));
  return std::ceil(first - slack) <= std::floor(last + slack);
}

// Beyond this, neighbouring numbers are too far apart to tell where in the period they are.
bool beyond_periods(const Interval& a) { return !(a.low > -1e12 && a.high < 1e12); }

Interval cosine_like(const Interval& a, double (*f)(double), double peak) {
  if (beyond_periods(a)) return {-1, 1, a.defined};
  Interval result = outward(std::min(f(a.low), f(a.high)), std::max(f(a.low), f(a.high)), a.defined, library_steps);
  if (may_reach(a, peak, 2 * pi)) result.high = 1;
  if (may_reach(a, peak + pi, 2 * pi)) result.low = -1;
  return clipped(result, -1, 1);
}

Interval tangent(const Interval& a) {
  if (beyond_periods(a) || may_reach(a, pi / 2, pi)) return whole_undefined;
  return monotone([](double v) { return std::tan(v); }, a);
}

// Of a domain [least, greatest].
template <class F>
Interval on_domain(F f, const Interval& a, double least, double greatest) {
  if (a.high < least || a.low > greatest) return whole_undefined;
  Interval result = monotone(f, clipped(a, least, greatest));
  result.defined = a.defined && a.low >= least && a.high <= greatest;
  return result;
}

Interval logarithm(const Interval& a) {
  if (a.high <= 0) return whole_undefined;
  return outward(a.low > 0 ? std::log(a.low) : -infinity, std::log(a.high), a.defined && a.low > 0, library_steps);
}

Interval power_integer(const Interval& a, double n) {
  const auto raised = [n](double v) { return v == 0 ? 0.0 : std::pow(v, n); };
  if (n == 0) return {1, 1, a.defined};
  if (n < 0) {
    if (a.low <= 0 && a.high >= 0) return whole_undefined;
    const double p = raised(a.low), q = raised(a.high);
    return outward(std::min(p, q), std::max(p, q), a.defined, library_steps);
  }
  const bool even = std::fmod(n, 2) == 0;
  const Interval base = even ? magnitude(a) : a;
  const double low = raised(base.low), high = raised(base.high);
  // Zero is exact, unless it is an underflow.
  return {base.low == 0 ? 0 : std::max(down(low, library_steps), even ? 0 : -infinity),
          base.high == 0 ? 0 : up(high, library_steps), a.defined};
}

Interval power(const Interval& a, const Interval& b) {
  if (b.low == b.high && std::floor(b.low) == b.low) {
    Interval result = power_integer(a, b.low);
    result.defined = result.defined && b.defined;
    return result;
  }
  if (a.low < 0 || (a.low == 0 && b.low < 0)) return whole_undefined;
  // Of a base that is not negative the power is monotone in either argument.
  Interval result{infinity, -infinity, a.defined && b.defined};
  for (const double x : {a.low, a.high})
    for (const double y : {b.low, b.high}) {
      const double v = std::pow(x, y);
      result.low = std::min(result.low, down(v, library_steps));
      result.high = std::max(result.high, up(v, library_steps));
    }
  result.low = std::max(result.low, 0.0);
  // Unbounded arguments: the corners are limits, and pow(1, infinity) = 1 hides what is close to it.
  if (std::isinf(b.low) || std::isinf(b.high)) return {0, infinity, result.defined};
  return result;
}

Interval arctangent2(const Interval& a, const Interval& b) {
  const bool origin = a.low <= 0 && a.high >= 0 && b.low <= 0 && b.high >= 0;
  const bool cut = a.low < 0 && a.high >= 0 && b.low < 0;
  const bool defined = a.defined && b.defined && !origin;
  if (origin || cut) return {-up(pi), up(pi), defined};
  Interval result{infinity, -infinity, defined};
  for (const double y : {a.low, a.high})
    for (const double x : {b.low, b.high}) {
      const double angle = std::atan2(y + 0.0, x);
      result.low = std::min(result.low, down(angle, library_steps));
      result.high = std::max(result.high, up(angle, library_steps));
    }
  return result;
}

// The quotient may be rounded up to an integer that it is below; then the remainder is as wrong as the product is.
Interval modulo(const Interval& a, const Interval& b) {
  if (b.low <= 0 && b.high >= 0) return whole_undefined;
  const bool defined = a.defined && b.defined;
  const double error = 4 * epsilon * (magnitude(a).high + magnitude(b).high);
  if (!std::isfinite(error)) return {-infinity, infinity, defined};
  const Interval q = quotient(a, b);
  Interval result{std::min(b.low, 0.0), std::max(b.high, 0.0), defined};
  if (std::floor(q.low) == std::floor(q.high)) {
    const double k = std::floor(q.low);
    const Interval rest = sum(a, negative(product({k, k, true}, b)));
    result.low = std::max(result.low, rest.low);
    result.high = std::min(result.high, rest.high);
  }
  return {down(result.low - error), up(result.high + error), defined};
}

Interval hull(const Interval& a, const Interval& b) {
  return {std::min(a.low, b.low), std::max(a.high, b.high), a.defined && b.defined};
}

Interval choose(const Interval& a, const Interval& b, const Interval& c, const Interval& d) {
  Interval result = a.high <= b.low ? c : a.low > b.high ? d : hull(c, d);
  result.defined = result.defined && a.defined && b.defined;
  return result;
}

double sign_of(double v) { return v > 0 ? 1 : v < 0 ? -1 : 0; }

}  // namespace

// clang-format off
Interval apply(Op op, double value, const Interval& a, const Interval& b, const Interval& c, const Interval& d) {
  switch (op) {
    case Op::constant: return {value, value, true};
    case Op::variable: return whole_undefined;
    case Op::negate: return negative(a);
    case Op::abs: return magnitude(a);
    case Op::sign: return {sign_of(a.low), sign_of(a.high), a.defined};
    case Op::floor: return {std::floor(a.low), std::floor(a.high), a.defined};
    case Op::sqrt:
      return a.high < 0 ? whole_undefined
                        : Interval{a.low <= 0 ? 0 : down(std::sqrt(a.low)), a.high == 0 ? 0 : up(std::sqrt(a.high)),
                                   a.defined && a.low >= 0};
    case Op::exp: return clipped(monotone([](double v) { return std::exp(v); }, a), 0, infinity);
    case Op::log: return logarithm(a);
    case Op::sin: return cosine_like(a, [](double v) { return std::sin(v); }, pi / 2);
    case Op::cos: return cosine_like(a, [](double v) { return std::cos(v); }, 0);
    case Op::tan: return tangent(a);
    case Op::asin: return on_domain([](double v) { return std::asin(v); }, a, -1, 1);
    case Op::acos: return negative(on_domain([](double v) { return -std::acos(v); }, a, -1, 1));
    case Op::atan: return monotone([](double v) { return std::atan(v); }, a);
    case Op::sinh: return monotone([](double v) { return std::sinh(v); }, a);
    case Op::cosh:
      return clipped(monotone([](double v) { return std::cosh(v); }, magnitude(a)), 1, infinity);
    case Op::tanh: return clipped(monotone([](double v) { return std::tanh(v); }, a), -1, 1);
    case Op::add: return sum(a, b);
    case Op::subtract: return sum(a, negative(b));
    case Op::multiply: return product(a, b);
    case Op::divide: return quotient(a, b);
    case Op::power_integer: return power_integer(a, value);
    case Op::pow: return power(a, b);
    case Op::atan2: return arctangent2(a, b);
    case Op::min: return {std::min(a.low, b.low), std::min(a.high, b.high), a.defined && b.defined};
    case Op::max: return {std::max(a.low, b.low), std::max(a.high, b.high), a.defined && b.defined};
    case Op::mod: return modulo(a, b);
    case Op::choose: return choose(a, b, c, d);
  }
  return whole_undefined;
}
// clang-format on

void IntervalEvaluator::operator()(std::span<const Interval> variables, std::span<Interval> results,
                                   std::vector<Interval>& scratch) const {
  require_fitting(program_, variables.size(), results.size());
  const auto variable = [&](std::size_t i) {
    return variables[i].low <= variables[i].high ? variables[i] : whole_undefined;  // which is no interval
  };
  const auto checked = [](Op op, double value, const Interval& a, const Interval& b, const Interval& c,
                          const Interval& d) {
    const Interval result = apply(op, value, a, b, c, d);
    return result.low <= result.high ? result : whole_undefined;
  };
  run_program(program_, variable, checked, results, scratch);
}

}  // namespace smurf::expression
