// Texts against values worked out in C++, and what is said of those that are wrong.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "unit/expression/expressions.hpp"

namespace smurf::expression {
namespace {

TEST(ExpressionParser, AcceptsWhatTheGrammarSays) {
  const double x = 1.25, y = -0.75, z = 2.5;
  const std::vector<std::pair<std::string, double>> cases = {
      {"1", 1},
      {"  .5 ", 0.5},
      {"1.", 1},
      {"1e-3", 0.001},
      {"2E+2", 200},
      {"1.5e2*2", 300},
      {"pi", pi},
      {"e", std::numbers::e},
      {"2*e", 2 * std::numbers::e},
      {"x", x},
      {"x+y*z", x + y * z},
      {"(x+y)*z", (x + y) * z},
      {"x-y-z", x - y - z},
      {"x/y/z", x / y / z},
      {"x/y*z", x / y * z},
      {"x-(y-z)", x - (y - z)},
      {"-x^2", -(x * x)},
      {"(-x)^2", x * x},
      {"2^-3", 0.125},
      {"2^3^2", 512},
      {"(2^3)^2", 64},
      {"2^-2^2", std::pow(2, -4)},
      {"-2^-2", -0.25},
      {"-x*y", -x * y},
      {"x*-y", x * -y},
      {"x--y", x + y},
      {"x+-+-y", x + y},
      {"--x", x},
      {"2^-x*y", std::pow(2, -x) * y},
      {"x^y", std::pow(x, y)},
      {"y^3", y * y * y},
      {"y^3.0", y * y * y},
      {"y^(1+2)", y * y * y},
      {"y^-2", 1 / (y * y)},
      {"pow(z, y)", std::pow(z, y)},
      {"pow(y, 3)", y * y * y},
      {"sin(x)", std::sin(x)},
      {"cos(x)", std::cos(x)},
      {"tan(x)", std::tan(x)},
      {"asin(y)", std::asin(y)},
      {"acos(y)", std::acos(y)},
      {"atan(x)", std::atan(x)},
      {"atan2(y, x)", std::atan2(y, x)},
      {"sinh(x)", std::sinh(x)},
      {"cosh(x)", std::cosh(x)},
      {"tanh(x)", std::tanh(x)},
      {"exp(x)", std::exp(x)},
      {"log(x)", std::log(x)},
      {"sqrt(x)", std::sqrt(x)},
      {"abs(y)", -y},
      {"floor(y)", -1},
      {"mod(y, 2)", y + 2},
      {"mod(x, -2)", x - 2},
      {"min(x, y)", y},
      {"max(x, y)", x},
      {"min(x, y, z, 3)", y},
      {"max(x, y, z)", z},
      {"max(min(x,y),(z))", z},
      {"\tx\n+\r\n y", x + y},
      {"(((x)))", x},
      {"a*x+longer_name2", 3 * x + 7},
      {"sin(x)^2", std::sin(x) * std::sin(x)},
  };
  for (const auto& [text, expected] : cases) {
    Graph graph;
    const NodeId root = read(graph, text, {{"a", 3}, {"longer_name2", 7}});
    EXPECT_NEAR(value_of(graph, root, {x, y, z}), expected, 4e-16 * std::abs(expected)) << text;
  }
}

TEST(ExpressionParser, OtherVariables) {
  Graph graph;
  const std::vector<std::string> uv = {"u", "v"};
  const NodeId root = parse(graph, "u-2*v", uv, {});
  EXPECT_EQ(value_of(graph, root, {5, 1, 0}), 3);
  expect_fragment(message_of([&] { parse(graph, "u+x", uv, {}); }),
                  "column 3: found \"x\", expected one of u, v, pi, e");
}

TEST(ExpressionParser, SaysWhatIsWrongAndWhere) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"x+*y", "expression \"x+*y\", column 3: found \"*\", expected a number, a name or \"(\""},
      {"", "column 1: found the end, expected a number, a name or \"(\""},
      {"   ", "column 4: found the end"},
      {"x+", "column 3: found the end"},
      {"2x", "column 2: found \"x\", expected an operator or the end"},
      {"x y", "column 3: found \"y\", expected an operator or the end"},
      {"2(x)", "column 2: found \"(\", expected an operator or the end"},
      {"(x", "column 3: found the end, expected an operator or \")\""},
      {"x)", "column 2: found \")\", expected an operator or the end"},
      {"()", "column 2: found \")\", expected a number"},
      {"(x,y)", "column 3: found \",\", expected an operator or \")\""},
      {"x,y", "column 2: found \",\", expected an operator or the end"},
      {"sin x", "column 5: found \"x\", expected \"(\" after \"sin\""},
      {"sin", "column 4: found the end, expected \"(\" after \"sin\""},
      {"sin()", "column 5: found \")\""},
      {"1+sin(x, y)", "column 3: \"sin\" takes 1 argument, found 2"},
      {"atan2(x)", "column 1: \"atan2\" takes 2 arguments, found 1"},
      {"pow(x,y,z)", "column 1: \"pow\" takes 2 arguments, found 3"},
      {"min(x)", "column 1: \"min\" takes 2 arguments or more, found 1"},
      {"max(x,)", "column 7: found \")\""},
      {"sin(x", "column 6: found the end, expected an operator, \",\" or \")\""},
      {"x^", "column 3: found the end"},
      {"x**2", "column 3: found \"*\""},
      {"w", "column 1: found \"w\", expected one of x, y, z, pi, e or a function such as sin"},
      {"X", "column 1: found \"X\""},
      {"sine(x)", "column 1: found \"sine\""},
      {"x(2)", "column 2: found \"(\""},
      {"1.2.3", "column 4: found \".3\""},
      {".", "column 1: found \".\""},
      {"2e", "column 2: found \"e\", expected an operator"},
      {"1e+", "column 2: found \"e\""},
      {"1e999", "column 1: the number 1e999 is out of range"},
      {"x+1e-999", "column 3: the number 1e-999 is out of range"},
      {"x=1", "column 2: found \"=\""},
      {"x;y", "column 2: found \";\""},
      {"x\xC2\xB2+y", "column 2: found \"\xC2\xB2\""},
      {"\xCF\x80*\xCF\x80", "column 1: found \"\xCF\x80\""},
      {"(\xE2\x88\x92x)", "column 2: found \"\xE2\x88\x92\""},
      {"x+\xFFy", "column 3: found \"?\""},
      {"x+\xC2", "column 3: found \"?\""},      // a character that is cut off
      {"x+\xC2\x85", "column 3: found \"?\""},  // a control character
      {std::string("x\0y", 3), "column 2: found \"?\""},
      {"x\n+\n*", "expression \"x + *\", column 5: found \"*\""},
  };
  for (const auto& [text, fragment] : cases) expect_fragment(refusal(text), fragment);
}

TEST(ExpressionParser, ColumnsCountCharacters) {
  Graph graph;
  const std::vector<std::string> names = {"x", "\xCF\x86"};
  // Names are of ASCII letters, so the second is never found; the column is that of a character, not of a byte.
  expect_fragment(message_of([&] { parse(graph, "x+\xCF\x86", names, {}); }), "column 3");
  expect_fragment(refusal("\xE2\x82\xAC"), "found \"\xE2\x82\xAC\"");
}

TEST(ExpressionParser, Parameters) {
  expect_fragment(refusal("x", {{"x", 1}}), "parameter \"x\" hides the variable");
  expect_fragment(refusal("x", {{"sin", 1}}), "parameter \"sin\" hides the function");
  expect_fragment(refusal("x", {{"pi", 3}}), "parameter \"pi\" hides the number");
  expect_fragment(refusal("x", {{"e", 3}}), "parameter \"e\" hides the number");
  expect_fragment(refusal("x", {{"1a", 3}}), "parameter \"1a\" is no name");
  expect_fragment(refusal("x", {{"", 3}}), "is no name");
  expect_fragment(refusal("x", {{"a", infinity}}), "parameter \"a\" is not finite");
  expect_fragment(refusal("x", {{"a", nan}}), "parameter \"a\" is not finite");
  expect_fragment(refusal("x+b", {{"a", 1}}), "expected one of x, y, z, a, pi, e");
  std::map<std::string, double> many;
  for (int i = 0; i < 1000; i++) many.emplace(fmt::format("p{}", i), i);
  EXPECT_EQ(refusal("x*p999", many), "");
  expect_fragment(refusal("x*q", many), "...");
}

TEST(ExpressionParser, LongTextsAreShownAroundThePlace) {
  const std::string message = refusal(repeated("x+", 5000) + "?" + repeated("+y", 5000));
  expect_fragment(message, "column 10001: found \"?\"");
  expect_fragment(message, "\"...");
  expect_fragment(message, "x+?+y");
  expect_fragment(message, "...\"");
  EXPECT_LT(message.size(), 200u);
  expect_fragment(refusal("x+" + repeated("w", 100000)), "found \"" + repeated("w", 40) + "...\"");
}

TEST(ExpressionParser, Limits) {
  const auto nested = [](std::size_t depth) { return repeated("(", depth) + "x" + repeated(")", depth); };
  EXPECT_EQ(refusal(nested(1000)), "");
  expect_fragment(refusal(nested(1001)), "column 1001: nested more than 1000 levels deep");
  expect_fragment(refusal(nested(10000)), "nested more than 1000 levels deep");
  EXPECT_EQ(refusal(repeated("sin(", 1000) + "x" + repeated(")", 1000)), "");
  expect_fragment(refusal(repeated("sin(", 10000)), "nested more than 1000 levels deep");
  // After closing, there is room again.
  EXPECT_EQ(refusal(repeated("(x)+", 5000) + "x"), "");

  EXPECT_EQ(refusal("x" + std::string(longest_text - 1, ' ')), "");
  expect_fragment(refusal("x" + std::string(longest_text, ' ')), "at most 1048576 are read");
  expect_fragment(refusal(std::string(10'000'000, '(')), "at most 1048576 are read");
  // What is as long as may be, and not parentheses, is no depth: signs, powers, sums, and one long number.
  EXPECT_EQ(refusal(std::string(1'000'000, '-') + "x"), "");
  EXPECT_EQ(refusal(repeated("x^", 500'000) + "x"), "");
  EXPECT_EQ(refusal(repeated("x-", 500'000) + "y"), "");
  EXPECT_EQ(refusal("max(" + repeated("x,", 500'000) + "y)"), "");
  EXPECT_EQ(refusal("0." + std::string(1'000'000, '3')), "");
  expect_fragment(refusal(std::string(1'000'000, '3')), "out of range");
  expect_fragment(refusal(std::string(1'000'000, '\xE2')), "found \"?\"");
}

TEST(ExpressionParser, IntegerExponentsBecomeIntegerPowers) {
  Graph graph;
  const auto expect = [&](std::string_view text, Op op, double value) {
    const Node& node = graph[read(graph, text)];
    EXPECT_EQ(node.op, op) << text;
    if (op == Op::power_integer) {
      EXPECT_EQ(node.value, value) << text;
    }
  };
  expect("x^1024", Op::power_integer, 1024);
  expect("x^-1024", Op::power_integer, -1024);
  expect("x^1025", Op::pow, 0);
  expect("x^-1025", Op::pow, 0);
  expect("x^2.5", Op::pow, 0);
  expect("x^y", Op::pow, 0);
  expect("x^0.5", Op::sqrt, 0);
  expect("pow(x, 7)", Op::power_integer, 7);
  expect("x*x", Op::power_integer, 2);
  expect("x*x*x", Op::power_integer, 3);
  expect("(x^2)^3", Op::power_integer, 6);
  expect("x^1", Op::variable, 0);
  EXPECT_NEAR(value_of("x^1026", {-1.001, 0, 0}), std::pow(1.001, 1026), 1e-12);
}

}  // namespace
}  // namespace smurf::expression
