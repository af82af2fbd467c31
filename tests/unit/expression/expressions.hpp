// For tests of expressions: reading and evaluating texts, what errors say, and random expressions as plain trees.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "expression/evaluate.hpp"
#include "expression/graph.hpp"
#include "expression/interval.hpp"
#include "expression/parser.hpp"
#include "smurf/error.hpp"

namespace smurf::expression {

using Point = std::array<double, 3>;

inline constexpr double pi = std::numbers::pi;
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double infinity = std::numeric_limits<double>::infinity();

inline const std::vector<std::string> xyz = {"x", "y", "z"};

inline NodeId read(Graph& graph, std::string_view text, const std::map<std::string, double>& parameters = {}) {
  return parse(graph, text, xyz, parameters);
}

inline double value_of(const Graph& graph, NodeId root, const Point& p) {
  double result = 0;
  std::vector<double> scratch;
  Evaluator(graph, std::span(&root, 1))(p, std::span(&result, 1), scratch);
  return result;
}

inline double value_of(std::string_view text, const Point& p = {}) {
  Graph graph;
  return value_of(graph, read(graph, text), p);
}

inline Interval bounds_of(const Graph& graph, NodeId root, const std::array<Interval, 3>& box) {
  Interval result;
  std::vector<Interval> scratch;
  IntervalEvaluator(graph, std::span(&root, 1))(box, std::span(&result, 1), scratch);
  return result;
}

inline Interval bounds_of(std::string_view text, double low, double high) {
  Graph graph;
  return bounds_of(graph, read(graph, text), {Interval{low, high}, Interval{low, high}, Interval{low, high}});
}

// The message of the Error (input) that it throws; empty if it throws none.
inline std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input) << error.what();
    EXPECT_EQ(std::string_view(error.what()).find('\n'), std::string_view::npos) << error.what();
    return error.what();
  }
  return {};
}

inline void expect_fragment(const std::string& message, const std::string& fragment) {
  EXPECT_NE(message.find(fragment), message.npos) << "\"" << message << "\" does not say: " << fragment;
  EXPECT_LT(message.size(), 600u) << message;
}

inline std::string refusal(std::string_view text, const std::map<std::string, double>& parameters = {}) {
  return message_of([&] {
    Graph graph;
    read(graph, text, parameters);
  });
}

inline std::string repeated(std::string_view text, std::size_t times) {
  std::string out;
  for (std::size_t i = 0; i < times; i++) out += text;
  return out;
}

// ---- Random expressions, as plain trees: evaluated without any simplification, and built into a graph

struct Tree {
  Op op = Op::constant;
  double value = 0;
  std::vector<Tree> arguments;

  double at(const Point& p) const {
    std::array<double, 4> a{};
    for (std::size_t i = 0; i < arguments.size(); i++) a[i] = arguments[i].at(p);
    return op == Op::variable ? p[std::size_t(value)] : apply(op, value, a[0], a[1], a[2], a[3]);
  }

  NodeId build(Graph& graph) const {
    std::vector<NodeId> a;
    for (const Tree& argument : arguments) a.push_back(argument.build(graph));
    switch (op) {
      case Op::constant:
        return graph.constant(value);
      case Op::variable:
        return graph.variable(int(value));
      case Op::power_integer:
        return graph.power(a[0], int(value));
      case Op::choose:
        return graph.choose(a[0], a[1], a[2], a[3]);
      default:
        return a.size() == 1 ? graph.unary(op, a[0]) : graph.binary(op, a[0], a[1]);
    }
  }

  // Of such powers only the value is defined: a^b with b varying and a not positive.
  bool has_power_without_slope(const Point& p) const {
    if (op == Op::pow && !(arguments[0].at(p) > 0)) return true;
    return std::any_of(arguments.begin(), arguments.end(), [&](const Tree& a) { return a.has_power_without_slope(p); });
  }

  std::string text() const {
    if (op == Op::constant) return fmt::format("{}", value);
    if (op == Op::variable) return xyz[std::size_t(value)];
    std::string out = fmt::format("{}{}(", int(op), op == Op::power_integer ? fmt::format(":{}", value) : "");
    for (const Tree& argument : arguments) out += (out.back() == '(' ? "" : ", ") + argument.text();
    return out + ")";
  }
};

class RandomTrees {
 public:
  explicit RandomTrees(unsigned seed) : random_(seed) {}

  int below(int n) { return int(random_() % unsigned(n)); }
  double uniform(double low, double high) {
    return low + (high - low) * double(random_()) / double(std::mt19937::max());
  }
  Point point(double reach) { return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)}; }

  Tree tree(int depth) {
    if (depth == 0 || below(8) == 0) {
      if (below(3) != 0) return {Op::variable, double(below(3)), {}};
      constexpr std::array constants = {0.0, 1.0, -1.0, 2.0, 0.5, -1.5, 3.0};
      return {Op::constant, constants[std::size_t(below(int(constants.size())))], {}};
    }
    // Sums and products are the most usual.
    const Op op = below(3) == 0 ? std::array{Op::add, Op::subtract, Op::multiply}[std::size_t(below(3))]
                                : Op(2 + below(operation_count - 2));
    Tree result{op, op == Op::power_integer ? double(below(8) - 3) : 0, {}};
    for (int i = 0; i < arity(op); i++) result.arguments.push_back(tree(depth - 1));
    return result;
  }

 private:
  std::mt19937 random_;
};

}  // namespace smurf::expression
