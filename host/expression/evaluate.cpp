#include "expression/evaluate.hpp"

#include <cmath>
#include <limits>

namespace smurf::expression {
namespace {

constexpr double undefined = std::numeric_limits<double>::quiet_NaN();

// The standard's pow(1, NaN) and pow(NaN, 0) are 1.
double power(double a, double b) {
  if (std::isnan(a) || std::isnan(b) || (a == 0 && b < 0)) return undefined;
  return std::pow(a, b);
}

}  // namespace

// clang-format off
double apply(Op op, double value, double a, double b, double c, double d) {
  switch (op) {
    case Op::constant: return value;
    case Op::variable: return undefined;
    case Op::negate: return -a;
    case Op::abs: return std::abs(a);
    case Op::sign: return a > 0 ? 1 : a < 0 ? -1 : a == 0 ? 0 : undefined;
    case Op::floor: return std::floor(a);
    case Op::sqrt: return std::sqrt(a);
    case Op::exp: return std::exp(a);
    case Op::log: return a > 0 ? std::log(a) : undefined;
    case Op::sin: return std::sin(a);
    case Op::cos: return std::cos(a);
    case Op::tan: return std::tan(a);
    case Op::asin: return std::asin(a);
    case Op::acos: return std::acos(a);
    case Op::atan: return std::atan(a);
    case Op::sinh: return std::sinh(a);
    case Op::cosh: return std::cosh(a);
    case Op::tanh: return std::tanh(a);
    case Op::add: return a + b;
    case Op::subtract: return a - b;
    case Op::multiply: return a * b;
    case Op::divide: return b == 0 ? undefined : a / b;
    case Op::power_integer: return power(a, value);
    case Op::pow: return power(a, b);
    case Op::atan2: return a == 0 && b == 0 ? undefined : std::atan2(a + 0.0, b);  // -0 is on no other side than 0
    case Op::min: return std::isnan(a) || std::isnan(b) ? undefined : std::fmin(a, b);
    case Op::max: return std::isnan(a) || std::isnan(b) ? undefined : std::fmax(a, b);
    case Op::mod: return b == 0 ? undefined : a - b * std::floor(a / b);
    case Op::choose: return std::isnan(a) || std::isnan(b) ? undefined : a <= b ? c : d;
  }
  return undefined;
}
// clang-format on

void Evaluator::operator()(std::span<const double> variables, std::span<double> results,
                           std::vector<double>& scratch) const {
  require_fitting(program_, variables.size(), results.size());
  run_program(
      program_, [&](std::size_t i) { return variables[i]; }, apply, results, scratch);
}

}  // namespace smurf::expression
