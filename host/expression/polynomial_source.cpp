#include "expression/polynomial_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "expression/source.hpp"

namespace smurf::expression {
namespace {

double binomial(int n, int k) {
  double result = 1;
  for (int i = 1; i <= k; i++) result = result * (n - k + i) / i;
  return result;
}

// A polynomial on the device: coefficients <name>_0 .. <name>_degree, size <name>_n, error <name>_e.
struct Polynomial {
  std::string name;
  int degree = 0;
};

class Writer {
 public:
  std::string text;

  Polynomial constant(double value) {
    const Polynomial p = next(0);
    const float rounded = float(value);
    const double error = rounded == value ? 0 : 1;  // units of ROUNDING
    line("real {}_0 = splat({});", p.name, float_literal(rounded));
    finish(p, fmt::format("splat({})", float_literal(std::abs(rounded))),
           fmt::format("splat({} * ROUNDING)", float_literal(float(error * std::abs(rounded)))));
    return p;
  }

  Polynomial coordinate(int axis) {
    const Polynomial p = next(1);
    const char name = "xyz"[axis];
    line("real {}_0 = from_{};", p.name, name);
    line("real {}_1 = to_{};", p.name, name);
    finish(p, fmt::format("greater(absolute(from_{0}), absolute(to_{0}))", name), fmt::format("error_{}", name));
    return p;
  }

  Polynomial negate(const Polynomial& a) {
    const Polynomial p = next(a.degree);
    for (int k = 0; k <= a.degree; k++) line("real {}_{} = -{}_{};", p.name, k, a.name, k);
    finish(p, a.name + "_n", a.name + "_e");
    return p;
  }

  Polynomial sum(Polynomial a, Polynomial b, bool minus) {
    const int degree = std::max(a.degree, b.degree);
    a = elevated(a, degree);
    b = elevated(b, degree);
    const Polynomial p = next(degree);
    for (int k = 0; k <= degree; k++)
      line("real {}_{} = {}_{} {} {}_{};", p.name, k, a.name, k, minus ? '-' : '+', b.name, k);
    finish(p, measured(p), fmt::format("{0}_e + {1}_e + (1.0f * ROUNDING) * ({0}_n + {1}_n)", a.name, b.name));
    return p;
  }

  // Coefficient k is the sum of all a_i b_(k-i); of a bound on their sizes the same holds.
  Polynomial product(const Polynomial& a, const Polynomial& b) {
    const Polynomial p = next(a.degree + b.degree);
    for (int k = 0; k <= p.degree; k++) {
      std::string terms;
      for (int i = std::max(0, k - b.degree); i <= std::min(a.degree, k); i++) {
        terms = terms.empty() ? fmt::format("{}_{} * {}_{}", a.name, i, b.name, k - i)
                              : fmt::format("multiply_add({}_{}, {}_{}, {})", a.name, i, b.name, k - i, terms);
      }
      line("real {}_{} = {};", p.name, k, terms);
    }
    // All products together are rounded by their sum's share, and so is each of the additions.
    const int roundings = std::min(a.degree, b.degree) + 1;
    finish(p, measured(p),
           fmt::format("{0}_n * {1}_e + {1}_n * {0}_e + {0}_e * {1}_e + ({2}.0f * ROUNDING) * ({0}_n * {1}_n)", a.name,
                       b.name, roundings));
    return p;
  }

  Polynomial power(const Polynomial& a, int exponent) {
    if (exponent == 0) return constant(1);
    Polynomial result, square = a;
    for (bool any = false;; square = product(square, square)) {
      if (exponent & 1) {
        result = any ? product(result, square) : square;
        any = true;
      }
      exponent >>= 1;
      if (exponent == 0) return result;
    }
  }

  // Degree elevation: times (1 + 1)^r in scaled form.
  Polynomial elevated(const Polynomial& a, int degree) {
    if (a.degree == degree) return a;
    const Polynomial p = next(degree);
    const int more = degree - a.degree;
    for (int k = 0; k <= degree; k++) {
      std::string terms;
      for (int i = std::max(0, k - more); i <= std::min(a.degree, k); i++) {
        const std::string factor = float_literal(float(binomial(more, k - i)));
        terms = terms.empty() ? fmt::format("{} * {}_{}", factor, a.name, i)
                              : fmt::format("multiply_add(splat({}), {}_{}, {})", factor, a.name, i, terms);
      }
      line("real {}_{} = {};", p.name, k, terms);
    }
    finish(p, a.name + "_n", fmt::format("{0}_e + ({1}.0f * ROUNDING) * {0}_n", a.name, std::min(a.degree, more) + 1));
    return p;
  }

  template <class... Arguments>
  void line(fmt::format_string<Arguments...> pattern, Arguments&&... arguments) {
    text += "  " + fmt::format(pattern, std::forward<Arguments>(arguments)...) + "\n";
  }

 private:
  Polynomial next(int degree) { return {fmt::format("p{}", count_++), degree}; }
  void finish(const Polynomial& p, const std::string& size, const std::string& error) {
    line("real {}_n = {};", p.name, size);
    line("real {}_e = {};", p.name, error);
  }

  // The greatest coefficient as it came out: sums that cancel are small, and so is what later products make of their errors.
  static std::string measured(const Polynomial& p) {
    std::string greatest;
    for (int k = 0; k <= p.degree; k++) {
      std::string size = fmt::format("absolute({}_{})", p.name, k);
      // Rounded up, for the bounds take it for exact.
      if (k > 0 && k < p.degree) size += " * " + float_literal(float(1.000001 / binomial(p.degree, k)));
      greatest = k == 0 ? size : fmt::format("greater({}, {})", greatest, size);
    }
    return greatest;
  }

  int count_ = 0;
};

}  // namespace

std::string polynomial_source(const Graph& graph, NodeId f, int degree) {
  Writer writer;
  std::map<NodeId, Polynomial> made;
  for (const NodeId id : reachable(graph, std::span(&f, 1))) {
    const Node& node = graph[id];
    const auto argument = [&](std::size_t i) { return made.at(node.arguments[i]); };
    switch (node.op) {
      case Op::constant:
        made[id] = writer.constant(node.value);
        break;
      case Op::variable:
        made[id] = writer.coordinate(int(node.value));
        break;
      case Op::negate:
        made[id] = writer.negate(argument(0));
        break;
      case Op::add:
      case Op::subtract:
        made[id] = writer.sum(argument(0), argument(1), node.op == Op::subtract);
        break;
      case Op::multiply:
        made[id] = writer.product(argument(0), argument(1));
        break;
      case Op::divide:  // by a constant
        made[id] = writer.product(argument(0), writer.constant(1 / graph[node.arguments[1]].value));
        break;
      default:
        made[id] = writer.power(argument(0), int(node.value));
        break;
    }
  }
  const Polynomial p = writer.elevated(made.at(f), degree);
  for (int k = 0; k <= degree; k++) {
    writer.line("piece.polynomial.b[{}] = {}_{} * {} - level;", k, p.name, k,
                float_literal(float(1 / binomial(degree, k))));
  }
  // The scaling, the level, and what the bounds themselves were rounded by.
  writer.line("piece.error = 1.1f * ({0}_e + (3.0f * ROUNDING) * ({0}_n + absolute(level)));", p.name);
  return writer.text;
}

}  // namespace smurf::expression
