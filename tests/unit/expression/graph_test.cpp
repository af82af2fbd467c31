// The graph: sharing, simplification that keeps what is undefined, depth; derivatives against closed forms and
// differences.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "expression/source.hpp"
#include "unit/expression/expressions.hpp"

namespace smurf::expression {
namespace {

TEST(ExpressionGraph, EqualExpressionsAreOneNode) {
  Graph graph;
  EXPECT_EQ(read(graph, "x*y+z"), read(graph, "z+y*x"));
  EXPECT_EQ(read(graph, "min(x,sin(y))"), read(graph, "min(sin(y),x)"));
  EXPECT_EQ(read(graph, "x-3"), read(graph, "x+(-3)"));
  EXPECT_EQ(read(graph, "0.1"), read(graph, "1e-1"));
  EXPECT_NE(read(graph, "x-y"), read(graph, "y-x"));
  EXPECT_NE(read(graph, "x/y"), read(graph, "y/x"));
  EXPECT_NE(read(graph, "atan2(x,y)"), read(graph, "atan2(y,x)"));
  EXPECT_NE(read(graph, "x^3"), read(graph, "x^4"));
  EXPECT_NE(read(graph, "x+y"), read(graph, "x*y"));
  const std::size_t before = graph.size();
  read(graph, "(x*y+z)*(z+x*y)");
  EXPECT_EQ(graph.size(), before + 1);
}

TEST(ExpressionGraph, ManyNodesKeepTheirIdentity) {
  Graph graph;
  const NodeId x = graph.variable(0);
  std::vector<NodeId> ids;
  for (int i = 0; i < 20000; i++) ids.push_back(graph.add(x, graph.constant(i + 0.5)));
  for (int i = 0; i < 20000; i++) ASSERT_EQ(graph.add(graph.constant(i + 0.5), x), ids[std::size_t(i)]);
  Graph copy = graph;
  EXPECT_EQ(copy.add(x, copy.constant(7.5)), ids[7]);
  EXPECT_EQ(copy.size(), graph.size());
}

TEST(ExpressionGraph, Simplifies) {
  Graph graph;
  const std::vector<std::pair<std::string, std::string>> same = {
      {"x+0", "x"},           {"0+x", "x"},
      {"x-0", "x"},           {"x*1", "x"},
      {"1*x", "x"},           {"x/1", "x"},
      {"-(-x)", "x"},         {"x^1", "x"},
      {"x^0", "1"},           {"0*x", "0"},
      {"sin(x)*0", "0"},      {"(x^2+y)*0", "0"},
      {"x*-1", "-x"},         {"0-x", "-x"},
      {"x-x", "0"},           {"x+x", "2*x"},
      {"x-(-y)", "x+y"},      {"x+(-y)", "x-y"},
      {"min(x,x)", "x"},      {"max(x,x)", "x"},
      {"2+3*4", "14"},        {"sin(0)", "0"},
      {"abs(-x)", "abs(x)"},  {"x*x", "x^2"},
      {"2*x*3", "6*x"},       {"-(3*x)", "x*-3"},
      {"3*(-x)", "x*-3"},     {"-(x-y)", "y-x"},

      {"x^2*x^3", "x^5"},     {"0*atan(x)*tanh(y)*cos(z)*floor(x)*abs(y)*min(x,y)*max(y,z)", "0"},
      {"(x/2)*0", "0"},       {"-0", "0"},
      {"log(x)*1", "log(x)"}, {"sqrt(x)+0", "sqrt(x)"},
  };
  for (const auto& [text, simpler] : same) EXPECT_EQ(read(graph, text), read(graph, simpler)) << text;
}

// Products of constants that leave the range of numbers stay two products.
TEST(ExpressionGraph, ConstantsStayInRange) {
  EXPECT_EQ(value_of("1e200*(1e200*x)", {1e-200, 0, 0}), 1e200);
  EXPECT_NEAR(value_of("1e-200*(1e-200*x)", {1e300, 0, 0}), 1e-100, 1e-114);
  EXPECT_EQ(value_of("1e308*10", {}), infinity);
  EXPECT_EQ(value_of("exp(1000)", {}), infinity);
}

TEST(ExpressionGraph, SimplificationKeepsWhatIsUndefined) {
  struct Case {
    std::string text;
    double x;
  };
  const std::vector<Case> undefined = {
      {"0*log(x)", -1},
      {"0*log(x)", 0},
      {"log(x)-log(x)", -1},
      {"sqrt(x)*0", -1},
      {"0/x", 0},
      {"x/x", 0},
      {"0*(1/x)", 0},
      {"x*x^-1", 0},
      {"(1/x)^0", 0},
      {"log(x)^0", -1},
      {"min(log(x),log(x))", -1},
      {"0*x^-2", 0},
      {"0*asin(x)", 2},
      {"0*acos(x)", -2},
      {"0*mod(1,x)", 0},
      {"mod(x,0)", 3},
      {"1/0", 0},
      {"0*(1/0)", 0},
      {"log(-1)", 0},
      {"log(0)", 0},
      {"sqrt(-1)*0", 0},
      {"0*atan2(x,x)", 0},
      {"0^-1", 0},
      {"x^-1", 0},
      {"x^1.5", -1},
      {"(x^-1)^0", 0},
      {"0*x^x", -0.5},
      {"0*sqrt(x)^2", -1},
      {"sqrt(x)^2", -1},
      {"(x^0.5)^2", -1},
      {"exp(log(x))", -1},
      {"x^-1*x^2", 0},
      {"(-1)^0.5", 0},
      {"0*0^-1", 0},
      {"1/x-1/x", 0},
      {"0*(x/0)", 1},
  };
  for (const Case& c : undefined) EXPECT_TRUE(std::isnan(value_of(c.text, {c.x, c.x, c.x}))) << c.text << " at " << c.x;
  Graph graph;
  const NodeId log_x = read(graph, "log(x)"), one = graph.constant(1);
  EXPECT_TRUE(std::isnan(value_of(graph, graph.choose(log_x, one, one, one), {-1, 0, 0})));
  EXPECT_EQ(graph.choose(graph.variable(0), one, log_x, log_x), log_x);
}

// The graph against trees evaluated as they stand, at points where operations are likely to be undefined.
TEST(ExpressionGraph, SimplifiedTreesAgreeWithPlainOnes) {
  RandomTrees random(11);
  int undefined = 0, compared = 0;
  for (int i = 0; i < 3000; i++) {
    const Tree tree = random.tree(1 + random.below(4));
    Graph graph;
    const NodeId root = tree.build(graph);
    for (int k = 0; k < 20; k++) {
      Point p;
      for (double& v : p) v = 0.25 * (random.below(17) - 8);  // products and sums of these are exact
      const double plain = tree.at(p), simplified = value_of(graph, root, p);
      if (std::isnan(plain)) {
        undefined++;
        EXPECT_FALSE(std::isfinite(simplified)) << tree.text() << " at " << p[0] << " " << p[1] << " " << p[2];
      } else if (std::abs(plain) < 1e6) {
        compared++;
        EXPECT_NEAR(simplified, plain, 1e-9 * (1 + std::abs(plain)))
            << tree.text() << " at " << p[0] << " " << p[1] << " " << p[2];
      }
    }
  }
  EXPECT_GT(undefined, 5000);
  EXPECT_GT(compared, 20000);
}

TEST(ExpressionGraph, RefusesWhatCannotBeMeant) {
  Graph graph;
  EXPECT_THROW(graph.constant(infinity), Error);
  EXPECT_THROW(graph.constant(nan), Error);
  EXPECT_THROW(graph.variable(-1), Error);
  const NodeId x = graph.variable(0);
  EXPECT_THROW(graph.unary(Op::add, x), Error);
  EXPECT_THROW(graph.unary(Op::power_integer, x), Error);
  EXPECT_THROW(graph.binary(Op::sin, x, x), Error);
  EXPECT_THROW(graph.binary(Op::choose, x, x), Error);
  double result = 0;
  std::vector<double> scratch;
  const std::array one_value = {1.0};
  const NodeId y = graph.variable(1);
  EXPECT_THROW(Evaluator(graph, std::span(&y, 1))(one_value, std::span(&result, 1), scratch), Error);
}

// Every pass over a graph, at a depth that no recursion survives.
TEST(ExpressionGraph, MayBeDeep) {
  constexpr int depth = 300'000;
  Graph graph;
  const NodeId x = graph.variable(0), y = graph.variable(1);
  NodeId sines = x, sums = x;
  for (int i = 0; i < depth; i++) {
    sines = graph.unary(Op::sin, sines);
    sums = graph.add(graph.negate(graph.subtract(y, sums)), graph.constant(i % 7));
  }
  const NodeId slope = derivative(graph, sines, 0);
  double product = 1, v = 0.5;
  for (int i = 0; i < depth; i++) {
    product *= std::cos(v);
    v = std::sin(v);
  }
  EXPECT_EQ(value_of(graph, sines, {0.5, 0, 0}), v);
  EXPECT_NEAR(value_of(graph, slope, {0.5, 0, 0}), product, 1e-9 * product);
  EXPECT_EQ(value_of(graph, derivative(graph, sums, 0), {0.5, 0, 0}), 1);
  EXPECT_EQ(value_of(graph, derivative(graph, sums, 1), {0.5, 0, 0}), -depth);
  EXPECT_EQ(polynomial_degree(graph, sums), 1);
  EXPECT_EQ(polynomial_degree(graph, sines), -1);
  EXPECT_TRUE(bounds_of(graph, sines, {Interval{0.4, 0.6}, {}, {}}).contains(v));
  std::vector<std::string> names;
  device_source(graph, std::span(&sines, 1), "", names);
  EXPECT_EQ(names[0], fmt::format("n{}", depth - 1));
  EXPECT_EQ(reachable(graph, std::span(&sines, 1)).size(), std::size_t(depth) + 1);
}

TEST(ExpressionGraph, ReachableIsInOrderAndNoMore) {
  Graph graph;
  const NodeId f = read(graph, "sin(x)*y+cos(z)"), g = read(graph, "sin(x)+5");
  const std::array roots = {g};
  const std::vector<NodeId> order = reachable(graph, roots);
  EXPECT_EQ(order.size(), 4u);  // x, sin(x), 5, +
  EXPECT_EQ(order.back(), g);
  EXPECT_EQ(std::count(order.begin(), order.end(), f), 0);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_TRUE(reachable(graph, {}).empty());
  const Program program = make_program(graph, roots);
  for (std::size_t i = 0; i < program.nodes.size(); i++)
    for (int k = 0; k < arity(program.nodes[i].op); k++) EXPECT_LT(program.nodes[i].arguments[std::size_t(k)], i);
  EXPECT_EQ(program.variables, 1);
}

TEST(ExpressionGraph, PolynomialDegree) {
  const std::vector<std::pair<std::string, int>> cases = {
      {"3", 0},
      {"x", 1},
      {"x*y*z", 3},
      {"x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8", 4},
      {"(x^2+y^2+z^2+3)^2-16*(x^2+y^2)", 4},
      {"(x+1)^3*(y-2)^4", 7},
      {"-(x^2)/3", 2},
      {"0*x^9+y", 1},
      {"sqrt(2)*x", 1},
      {"sin(1)*x^2", 2},
      {"x/y", -1},
      {"1/x", -1},
      {"x^-1", -1},
      {"x^0.5", -1},
      {"sin(x)", -1},
      {"sin(x)*0+y", 1},
      {"abs(x)", -1},
      {"min(x,y)", -1},
      {"x^2+exp(y)", -1},
      {"x/0", -1},
      {"log(-1)*x", -1},
      {"((x^1024)^1024)^1024", 1'000'000'000},
  };
  for (const auto& [text, degree] : cases) {
    Graph graph;
    EXPECT_EQ(polynomial_degree(graph, read(graph, text)), degree) << text;
  }
}

// ---- Derivatives

TEST(ExpressionDerivative, ClosedForms) {
  const double x = 0.7, y = -0.4, z = 1.3;
  struct Case {
    std::string text;
    int variable;
    double expected;
  };
  const std::vector<Case> cases = {
      {"5", 0, 0},
      {"y", 0, 0},
      {"x", 0, 1},
      {"-x", 0, -1},
      {"abs(x)", 0, 1},
      {"abs(y)", 1, -1},
      {"floor(x)", 0, 0},
      {"sqrt(x)", 0, 0.5 / std::sqrt(x)},
      {"exp(2*x)", 0, 2 * std::exp(2 * x)},
      {"log(x)", 0, 1 / x},
      {"sin(3*x)", 0, 3 * std::cos(3 * x)},
      {"cos(x)", 0, -std::sin(x)},
      {"tan(x)", 0, 1 / (std::cos(x) * std::cos(x))},
      {"asin(y)", 1, 1 / std::sqrt(1 - y * y)},
      {"acos(y)", 1, -1 / std::sqrt(1 - y * y)},
      {"atan(x)", 0, 1 / (1 + x * x)},
      {"sinh(x)", 0, std::cosh(x)},
      {"cosh(x)", 0, std::sinh(x)},
      {"tanh(x)", 0, 1 - std::tanh(x) * std::tanh(x)},
      {"x+y", 0, 1},
      {"y-x", 0, -1},
      {"x*y", 0, y},
      {"x*sin(x)", 0, std::sin(x) + x * std::cos(x)},
      {"x/y", 0, 1 / y},
      {"x/y", 1, -x / (y * y)},
      {"x^5", 0, 5 * std::pow(x, 4)},
      {"y^-3", 1, -3 * std::pow(y, -4)},
      {"x^-1024", 0, -1024 * std::pow(x, -1025)},
      {"x^1025", 0, 1025 * std::pow(x, 1024)},
      {"x^2.5", 0, 2.5 * std::pow(x, 1.5)},
      {"x^y", 0, y * std::pow(x, y - 1)},
      {"x^y", 1, std::pow(x, y) * std::log(x)},
      {"x^x", 0, std::pow(x, x) * (std::log(x) + 1)},
      {"2^x", 0, std::pow(2, x) * std::log(2)},
      {"atan2(y,x)", 0, -y / (x * x + y * y)},
      {"atan2(y,x)", 1, x / (x * x + y * y)},
      {"min(x,z)", 0, 1},
      {"min(x,z)", 2, 0},
      {"max(x,z)", 0, 0},
      {"max(x^2,z^2)", 2, 2 * z},
      {"mod(z,x)", 2, 1},
      {"mod(z,x)", 0, -1},
      {"mod(5*z,x)", 0, -9},
      {"log(y^2)*sqrt(x)", 0, std::log(y * y) * 0.5 / std::sqrt(x)},
  };
  for (const Case& c : cases) {
    Graph graph;
    const NodeId slope = derivative(graph, read(graph, c.text), c.variable);
    EXPECT_NEAR(value_of(graph, slope, {x, y, z}), c.expected, 1e-12 * (1 + std::abs(c.expected)))
        << c.text << " by variable " << c.variable;
  }
  // Beyond the least integer exponent a general power would need a positive base.
  Graph least;
  const NodeId slope = derivative(least, read(least, "x^-1024"), 0);
  for (const NodeId id : reachable(least, std::span(&slope, 1))) EXPECT_NE(least[id].op, Op::pow);

  Graph graph;
  const NodeId a = graph.variable(0), b = graph.variable(1);
  const NodeId either = graph.choose(a, b, graph.power(a, 2), graph.power(a, 3));
  EXPECT_EQ(value_of(graph, derivative(graph, either, 0), {0.5, 1, 0}), 1);
  EXPECT_EQ(value_of(graph, derivative(graph, either, 0), {0.5, 0, 0}), 0.75);
  EXPECT_EQ(derivative(graph, graph.unary(Op::sign, a), 0), graph.constant(0));
}

TEST(ExpressionDerivative, AtCreases) {
  Graph graph;
  const auto slope = [&](std::string_view text, const Point& p) {
    return value_of(graph, derivative(graph, read(graph, text), 0), p);
  };
  EXPECT_EQ(slope("abs(x)", {0, 0, 0}), 1);
  const NodeId a = graph.variable(0), b = graph.multiply(graph.variable(0), graph.constant(3));
  for (const Op op : {Op::min, Op::max}) {
    const Node node = graph[graph.binary(op, a, b)];
    const NodeId first = derivative(graph, node.arguments[0], 0);
    EXPECT_EQ(value_of(graph, derivative(graph, graph.binary(op, a, b), 0), {0, 0, 0}), value_of(graph, first, {}));
  }
}

// At a few scales: where differences of two widths agree, the function is smooth enough to judge by them.
int compare_with_differences(const Tree& tree, Graph& graph, NodeId root, const Point& p) {
  int compared = 0;
  for (int axis = 0; axis < 3; axis++) {
    const auto difference = [&](double h) {
      Point before = p, after = p;
      before[std::size_t(axis)] -= h;
      after[std::size_t(axis)] += h;
      return (value_of(graph, root, after) - value_of(graph, root, before)) / (2 * h);
    };
    const double wide = difference(2e-5), narrow = difference(1e-5), level = value_of(graph, root, p);
    if (!std::isfinite(wide) || !std::isfinite(narrow) || std::abs(level) > 1e4) continue;
    if (std::abs(wide - narrow) > 1e-6 * (1 + std::abs(narrow))) continue;
    const double slope = value_of(graph, derivative(graph, root, axis), p);
    if (std::isnan(slope) && tree.has_power_without_slope(p)) continue;
    EXPECT_NEAR(slope, narrow, 1e-5 * (1 + std::abs(narrow) + std::abs(level)))
        << tree.text() << " by " << xyz[std::size_t(axis)] << " at " << p[0] << " " << p[1] << " " << p[2];
    compared++;
  }
  return compared;
}

TEST(ExpressionDerivative, EveryOperationAgreesWithDifferences) {
  RandomTrees random(5);
  for (int op = 2; op < operation_count; op++) {
    const auto inner = [](Op outer, double factor, int variable) {
      return Tree{outer, 0, {Tree{Op::constant, factor, {}}, Tree{Op::variable, double(variable), {}}}};
    };
    int compared = 0;
    for (int i = 0; i < 50; i++) {
      Tree tree{Op(op), Op(op) == Op::power_integer ? double(i % 9 - 4) : 0, {}};
      const std::array arguments = {inner(Op::multiply, 0.8, 0), inner(Op::add, 0.3, 1), inner(Op::multiply, -2, 0),
                                    inner(Op::multiply, 3, 2)};
      for (int k = 0; k < arity(Op(op)); k++) tree.arguments.push_back(arguments[std::size_t(k)]);
      Graph graph;
      compared += compare_with_differences(tree, graph, tree.build(graph), random.point(1));
    }
    EXPECT_GT(compared, 30) << "operation " << op;
  }
}

TEST(ExpressionDerivative, RandomExpressionsAgreeWithDifferences) {
  RandomTrees random(6);
  int expressions = 0, compared = 0;
  while (expressions < 200) {
    const Tree tree = random.tree(3 + random.below(3));
    Graph graph;
    const NodeId root = tree.build(graph);
    int here = 0;
    for (int i = 0; i < 10; i++) here += compare_with_differences(tree, graph, root, random.point(2));
    if (graph.is_constant(root) || here == 0) continue;
    expressions++;
    compared += here;
  }
  EXPECT_GT(compared, 2000);
}

TEST(ExpressionDerivative, SecondDerivatives) {
  Graph graph;
  const NodeId f = read(graph, "sin(x*y)+x^3*z");
  const double x = 0.3, y = 1.7, z = -0.6;
  const auto second = [&](int i, int k) {
    return value_of(graph, derivative(graph, derivative(graph, f, i), k), {x, y, z});
  };
  EXPECT_NEAR(second(0, 0), -y * y * std::sin(x * y) + 6 * x * z, 1e-14);
  EXPECT_NEAR(second(0, 1), std::cos(x * y) - x * y * std::sin(x * y), 1e-14);
  EXPECT_NEAR(second(1, 0), second(0, 1), 1e-15);
  EXPECT_NEAR(second(0, 2), 3 * x * x, 1e-14);
  EXPECT_EQ(second(2, 2), 0);
}

// Without sharing, derivatives of nested products grow exponentially.
TEST(ExpressionDerivative, StaysSmall) {
  Graph graph;
  NodeId f = graph.variable(0);
  for (int i = 0; i < 200; i++) f = graph.multiply(graph.unary(Op::sin, f), graph.add(f, graph.constant(1 + i)));
  derivative(graph, derivative(graph, f, 0), 0);
  EXPECT_LT(graph.size(), 20000u);
}

}  // namespace
}  // namespace smurf::expression
