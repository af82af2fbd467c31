// Generated device source, against the double reader by an interpreter of its statements.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "expression/source.hpp"
#include "unit/expression/expressions.hpp"

namespace smurf::expression {
namespace {

// Reads the statements as a compiler would, and computes each in double precision.
class Statements {
 public:
  Statements(const std::string& text, const Point& p) {
    for (int i = 0; i < 3; i++) values_[fmt::format("v{}", i)] = p[std::size_t(i)];
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) add(line);
  }
  double operator[](const std::string& name) const { return values_.at(name); }

 private:
  void add(const std::string& line) {
    const std::string begin = "    NUMBER ";
    ASSERT_TRUE(line.starts_with(begin) && line.ends_with(");")) << line;
    const auto equals = line.find(" = OP_"), opening = line.find('(');
    ASSERT_NE(equals, line.npos);
    const std::string name = line.substr(begin.size(), equals - begin.size());
    std::string word = line.substr(equals + 6, opening - equals - 6);
    std::vector<double> arguments;
    std::istringstream list(line.substr(opening + 1, line.size() - opening - 3));
    for (std::string argument; std::getline(list, argument, ',');)
      arguments.push_back(argument_value(argument.substr(argument.find_first_not_of(' '))));
    ASSERT_FALSE(values_.contains(name)) << line;
    values_[name] = result_of(word, arguments);
  }

  double argument_value(const std::string& text) const {
    if (values_.contains(text)) return values_.at(text);
    const bool number = text.ends_with('f');
    if (number) {
      EXPECT_NE(text.find_first_of(".e"), text.npos) << text;
    }
    std::size_t read = 0;
    const double value = std::stod(text, &read);
    EXPECT_EQ(read, text.size() - (number ? 1 : 0)) << text;
    return value;
  }

  static double result_of(const std::string& word, const std::vector<double>& arguments) {
    static const std::map<std::string, Op> operations = {{"CONSTANT", Op::constant},
                                                         {"NEGATE", Op::negate},
                                                         {"ABS", Op::abs},
                                                         {"SIGN", Op::sign},
                                                         {"FLOOR", Op::floor},
                                                         {"SQRT", Op::sqrt},
                                                         {"EXP", Op::exp},
                                                         {"LOG", Op::log},
                                                         {"SIN", Op::sin},
                                                         {"COS", Op::cos},
                                                         {"TAN", Op::tan},
                                                         {"ASIN", Op::asin},
                                                         {"ACOS", Op::acos},
                                                         {"ATAN", Op::atan},
                                                         {"SINH", Op::sinh},
                                                         {"COSH", Op::cosh},
                                                         {"TANH", Op::tanh},
                                                         {"ADD", Op::add},
                                                         {"SUBTRACT", Op::subtract},
                                                         {"MULTIPLY", Op::multiply},
                                                         {"DIVIDE", Op::divide},
                                                         {"POWER_INTEGER", Op::power_integer},
                                                         {"POW", Op::pow},
                                                         {"ATAN2", Op::atan2},
                                                         {"MIN", Op::min},
                                                         {"MAX", Op::max},
                                                         {"MOD", Op::mod},
                                                         {"CHOOSE", Op::choose},
                                                         {"ADD_CONSTANT", Op::add},
                                                         {"INEXACT", Op::constant},
                                                         {"ADD_INEXACT", Op::add},
                                                         {"MULTIPLY_INEXACT", Op::multiply},
                                                         {"MULTIPLY_CONSTANT", Op::multiply}};
    const auto found = operations.find(word);
    EXPECT_NE(found, operations.end()) << word;
    if (found == operations.end()) return nan;
    const Op op = found->second;
    std::array<double, 4> a{};
    std::copy(arguments.begin(), arguments.end(), a.begin());
    const std::size_t numbers = op == Op::constant ? 1 : op == Op::power_integer ? 2 : std::size_t(arity(op));
    const std::size_t expected = numbers + (word.ends_with("INEXACT") ? 1 : 0);
    EXPECT_EQ(arguments.size(), expected) << word;
    if (op == Op::constant) return a[0];
    return apply(op, a[1], a[0], a[1], a[2], a[3]);  // the exponent of an integer power stands second
  }

  std::map<std::string, double> values_;
};

TEST(ExpressionSource, ComputesWhatTheGraphDoes) {
  constexpr std::array jumping = {"FLOOR", "MOD", "CHOOSE", "SIGN"};
  RandomTrees random(21);
  int compared = 0;
  for (int i = 0; i < 500; i++) {
    Graph graph;
    const std::array roots = {random.tree(4).build(graph), random.tree(3).build(graph), random.tree(2).build(graph)};
    std::vector<std::string> names;
    const std::string text = device_source(graph, roots, i % 2 ? "f_" : "", names);
    ASSERT_EQ(names.size(), roots.size());
    const Point p = random.point(2);
    const Statements statements(text, p);
    for (std::size_t k = 0; k < roots.size(); k++) {
      const double expected = value_of(graph, roots[k], p), found = statements[names[k]];
      if (std::isnan(expected)) {
        EXPECT_TRUE(std::isnan(found)) << text;
        continue;
      }
      if (!(std::abs(expected) < 1e4)) continue;
      // Constants are rounded to float, so what jumps may jump elsewhere.
      const bool jumps =
          std::any_of(jumping.begin(), jumping.end(), [&](const char* word) { return text.find(word) != text.npos; });
      if (jumps) continue;
      compared++;
      EXPECT_NEAR(found, expected, 1e-4 * (1 + std::abs(expected))) << text;
    }
  }
  EXPECT_GT(compared, 300);
}

TEST(ExpressionSource, IsWrittenAsTheKernelsExpect) {
  Graph graph;
  const std::array roots = {read(graph, "2.5*sin(x)^3-1"),   read(graph, "y"),         read(graph, "7"),
                            read(graph, "atan2(z,4)/(8-x)"), read(graph, "0.1*y+0.3"), read(graph, "x^0.7")};
  std::vector<std::string> names;
  const std::string text = device_source(graph, roots, "", names);
  EXPECT_EQ(text,
            "    NUMBER n0 = OP_SIN(v0);\n"
            "    NUMBER n1 = OP_POWER_INTEGER(n0, 3);\n"
            "    NUMBER n2 = OP_MULTIPLY_CONSTANT(n1, 2.5f);\n"
            "    NUMBER n3 = OP_ADD_CONSTANT(n2, -1.0f);\n"
            "    NUMBER n4 = OP_CONSTANT(7.0f);\n"
            "    NUMBER n5 = OP_CONSTANT(4.0f);\n"
            "    NUMBER n6 = OP_ATAN2(v2, n5);\n"
            "    NUMBER n7 = OP_CONSTANT(8.0f);\n"
            "    NUMBER n8 = OP_SUBTRACT(n7, v0);\n"
            "    NUMBER n9 = OP_DIVIDE(n6, n8);\n"
            "    NUMBER n10 = OP_MULTIPLY_INEXACT(v1, 0.1f, -7.450581e-09f);\n"
            "    NUMBER n11 = OP_ADD_INEXACT(n10, 0.3f, -2.9802322e-08f);\n"
            "    NUMBER n12 = OP_INEXACT(0.7f, 5.9604645e-08f);\n"
            "    NUMBER n13 = OP_POW(v0, n12);\n");
  EXPECT_EQ(names, (std::vector<std::string>{"n3", "v1", "n4", "n9", "n11", "n13"}));
  EXPECT_EQ(device_source(graph, roots, "g_", names).substr(0, 31), "    NUMBER g_n0 = OP_SIN(v0);\n ");
  EXPECT_EQ(names[0], "g_n3");
}

TEST(ExpressionSource, ConstantsLieBetweenTwoFloats) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> mantissa(-2, 2), exponent(-150, 127);
  for (int i = 0; i < 20000; i++) {
    const double value = mantissa(random) * std::exp2(exponent(random));
    if (std::abs(value) > 3.4e38) continue;
    const DeviceConstant c = device_constant(value);
    const double from = c.value, to = double(c.value) + double(c.way);
    EXPECT_LE(std::min(from, to), value);
    EXPECT_GE(std::max(from, to), value);
    EXPECT_LE(std::abs(value - from), 0.5 * std::abs(double(c.way)));
    EXPECT_LE(std::abs(double(c.way)), std::max(std::abs(value) * 0x1p-22, 0x1p-125)) << value;
    EXPECT_EQ(c.way == 0, double(float(value)) == value && std::abs(value) >= 0x1p-126) << value;
  }
  EXPECT_EQ(device_constant(-0.375).way, 0);
  EXPECT_EQ(device_constant(0).way, 0);
}

TEST(ExpressionSource, LiteralsReadBack) {
  std::mt19937 random(1);
  for (int i = 0; i < 20000; i++) {
    const auto bits = std::uint32_t(random());
    const float value = std::bit_cast<float>(bits);
    if (!std::isfinite(value)) continue;
    const std::string text = float_literal(value);
    EXPECT_EQ(std::bit_cast<std::uint32_t>(std::strtof(text.c_str(), nullptr)), bits) << text;
    EXPECT_NE(text.find_first_of(".e"), text.npos) << text;
    EXPECT_EQ(text.back(), 'f');
  }
  EXPECT_EQ(float_literal(1), "1.0f");
  EXPECT_EQ(float_literal(-0.1f), "-0.1f");
  EXPECT_EQ(float_literal(1e20f), "1e+20f");
  Graph graph;
  std::vector<std::string> names;
  const NodeId great = read(graph, "1e39*x"), alone = read(graph, "sin(x)/1e300");
  expect_fragment(message_of([&] { device_source(graph, std::span(&great, 1), "", names); }), "1e+39");
  expect_fragment(message_of([&] { device_source(graph, std::span(&alone, 1), "", names); }), "too great for single");
}

}  // namespace
}  // namespace smurf::expression
