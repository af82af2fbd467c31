// Expressions as tapes: what pruning leaves out does not matter within the box, and a tape does what its program does.
#include "expression/tape.hpp"

#include <set>
#include <utility>

#include "expression/source.hpp"
#include "unit/expression/expressions.hpp"

namespace smurf::expression {
namespace {

double run(const Program& program, const Point& p) {
  double result = 0;
  std::vector<double> values;
  const auto variable = [&](std::size_t i) { return p[i]; };
  run_program<double>(
      program, variable,
      [](Op op, double value, double a, double b, double c, double d) { return apply(op, value, a, b, c, d); },
      std::span(&result, 1), values);
  return result;
}

// With the floats that devices have for constants.
Program rounded(Program program) {
  for (Node& node : program.nodes) {
    if (node.op == Op::constant) node.value = device_constant(node.value).value;
  }
  return program;
}

// As kernels do it, in double.
double run(const Tape& tape, const Point& p) {
  std::vector<double> registers(std::size_t(tape.registers), nan);
  for (std::uint32_t i = 0; i < tape.words[0]; i++) {
    const std::uint32_t code = tape.words[2 + 2 * i], more = tape.words[3 + 2 * i];
    const auto at = [&](std::uint32_t number) {
      return registers.at(std::min<std::size_t>(number, registers.size() - 1));
    };
    const double a = at((code >> 14) & 511), b = at((code >> 23) & 511);
    const int op = int(code & 31);
    double result;
    if (op == operation_count) {
      result = a + std::bit_cast<float>(more);
    } else if (op == operation_count + 1) {
      result = a * std::bit_cast<float>(more);
    } else if (Op(op) == Op::variable) {
      result = p[more];
    } else if (Op(op) == Op::constant) {
      result = std::bit_cast<float>(more);
    } else if (Op(op) == Op::power_integer) {
      result = apply(Op(op), int(more), a, b, 0, 0);
    } else {
      result = apply(Op(op), 0, a, b, at(more & 511), at((more >> 9) & 511));
    }
    registers.at((code >> 5) & 511) = result;
  }
  return registers.at(tape.words[1]);
}

TEST(ExpressionTapes, DoWhatTheirProgramsDo) {
  RandomTrees random(31);
  int compared = 0;
  for (int n = 0; n < 3000; n++) {
    Graph graph;
    const NodeId root = random.tree(6).build(graph);
    Program program;
    // Some trees come down to constants that floats do not hold.
    if (!message_of([&] { program = device_program(graph, root); }).empty()) continue;
    const Tape tape = make_tape(program);
    ASSERT_LE(tape.registers, int(program.nodes.size()));
    for (int i = 0; i < 5; i++) {
      const Point p = random.point(3);
      const double expected = run(rounded(program), p), found = run(tape, p);
      ASSERT_TRUE(expected == found || (std::isnan(expected) && std::isnan(found))) << expected << " " << found;
      compared += !std::isnan(expected);
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST(ExpressionTapes, InexactConstantsSayWhereTheyLie) {
  Graph graph;
  const NodeId root = read(graph, "(0.1*x+0.3)*x^0.7+y/16777217+1e-50*z+0.25");
  const Tape tape = make_tape(device_program(graph, root));
  std::set<std::pair<float, float>> found;
  for (std::uint32_t i = 0; i < tape.words[0]; i++) {
    const std::uint32_t code = tape.words[2 + 2 * i], more = tape.words[3 + 2 * i], op = code & 31;
    if (op == std::uint32_t(Op::constant) || op == operation_count || op == operation_count + 1)
      found.emplace(std::bit_cast<float>(more), std::bit_cast<float>(code & 0xff800000u));
  }
  const float least = std::numeric_limits<float>::min();
  const std::set<std::pair<float, float>> expected{{0.1f, -0x1p-27f}, {0.3f, -0x1p-25f}, {0.7f, 0x1p-24f},
                                                   {0.25f, 0},        {0x1p24f, 2.0f},   {0, 2 * least}};
  EXPECT_EQ(found, expected);
}

TEST(ExpressionTapes, WhatIsLeftOutDoesNotMatter) {
  RandomTrees random(32);
  std::size_t whole = 0, left = 0;
  int compared = 0;
  for (int n = 0; n < 4000; n++) {
    Graph graph;
    const NodeId root = random.tree(7).build(graph);
    Program program;
    if (!message_of([&] { program = device_program(graph, root); }).empty()) continue;
    const Point low = random.point(2);
    std::array<Interval, 3> box;
    for (std::size_t k = 0; k < 3; k++) box[k] = {low[k], low[k] + random.uniform(0, 1), true};
    std::vector<Interval> values;
    evaluate(program, box, values);
    const Program rest = pruned(program, values);
    whole += program.nodes.size();
    left += rest.nodes.size();
    for (int i = 0; i < 5; i++) {
      Point p;
      for (std::size_t k = 0; k < 3; k++) p[k] = random.uniform(box[k].low, box[k].high);
      const double expected = run(program, p), found = run(rest, p);
      // Interval bounds are widened by rounding, so that a choice between two equal numbers may go either way.
      ASSERT_TRUE(expected == found || (std::isnan(expected) && std::isnan(found))) << expected << " " << found;
      compared += !std::isnan(expected);
    }
  }
  EXPECT_GT(compared, 5000);
  EXPECT_LT(left, whole * 95 / 100) << "hardly anything was left out";
}

TEST(ExpressionTapes, NothingIsLeftOutThatMayBeUndefined) {
  Graph graph;
  // log(x) lies below 9 wherever it is defined, but it is not defined everywhere.
  const Program program = device_program(graph, read(graph, "max(log(x), 9+y)"));
  const auto rest_on = [&](double low, double high) {
    std::vector<Interval> values;
    evaluate(program, std::array{Interval{low, high}, Interval{0, 1}, Interval{0, 1}}, values);
    return pruned(program, values).nodes.size();
  };
  EXPECT_EQ(rest_on(-1, 1), program.nodes.size());
  EXPECT_EQ(rest_on(1, 2), 3u) << "9, y and their sum";
}

TEST(ExpressionTapes, RegistersAreUsedAgain) {
  Graph graph;
  NodeId root = graph.variable(0);
  for (int i = 0; i < 2000; i++) root = graph.unary(Op::sin, root);
  const Tape tape = make_tape(device_program(graph, root));
  EXPECT_EQ(tape.words[0], 2001u);
  EXPECT_EQ(tape.registers, 1);
}

TEST(ExpressionTapes, TooManyWaitingResultsAreRefused) {
  Graph graph;
  // Every sine is needed again after the last of them.
  std::string first = "0", second = "1";
  for (int i = 1; i <= most_registers + 10; i++) {
    first += fmt::format("+sin({}*x)", i);
    second += fmt::format("*(sin({}*x)+2)", i);
  }
  const NodeId root = read(graph, fmt::format("({})*({})", first, second));
  expect_fragment(message_of([&] { make_tape(device_program(graph, root)); }), "waiting");
  expect_fragment(message_of([&] { device_program(graph, read(graph, "x+1e300")); }), "single precision");
}

}  // namespace
}  // namespace smurf::expression
