// Roots on lines proved in double: series of expressions enclose what they stand for, and what is found on stretches of
// lines is what closed forms say.
#include "expression/line_roots.hpp"

#include <cmath>

#include "expression/series.hpp"
#include "unit/expression/expressions.hpp"

namespace smurf::expression {
namespace {

using Kind = LineRoot::Kind;

// Of an expression in x on [low, high], where x = t.
std::vector<LineRoot> roots_of(const std::string& text, double low, double high, double level = 0) {
  Graph graph;
  const LineRoots roots(graph, read(graph, text), level);
  std::vector<LineRoot> found;
  roots.find({0, 0.25, -1}, {1, 0, 0}, low, high, found);
  return found;
}

void expect_ones(const std::string& text, double low, double high, const std::vector<double>& expected,
                 double level = 0) {
  const std::vector<LineRoot> found = roots_of(text, low, high, level);
  ASSERT_EQ(found.size(), expected.size()) << text;
  for (std::size_t i = 0; i < found.size(); i++) {
    EXPECT_EQ(found[i].kind, Kind::one) << text;
    const double slack = 4e-16 * std::abs(expected[i]);
    EXPECT_LE(found[i].low, expected[i] + slack) << text;
    EXPECT_GE(found[i].high, expected[i] - slack) << text;
    EXPECT_LE(found[i].high - found[i].low, 0x1p-25 * std::max(std::abs(low), std::abs(high))) << text;
  }
}

// The one flagged stretch, that it contains `root` and how wide it is.
double flagged_width(const std::string& text, double low, double high, double root, Kind kind) {
  const std::vector<LineRoot> found = roots_of(text, low, high);
  EXPECT_EQ(found.size(), 1u) << text;
  if (found.size() != 1) return 1e300;
  EXPECT_EQ(found[0].kind, kind) << text;
  EXPECT_LE(found[0].low, root) << text;
  EXPECT_GE(found[0].high, root) << text;
  return found[0].high - found[0].low;
}

TEST(LineRoots, SimpleRootsAreProved) {
  expect_ones("x^2-2", 0, 3, {std::sqrt(2.0)});
  expect_ones("x^2-2", -3, 3, {-std::sqrt(2.0), std::sqrt(2.0)});
  expect_ones("x^3-x", -2, 2, {-1, 0, 1});
  expect_ones("x", -1, 1, {0});  // in the very middle
  expect_ones("sin(x)", 1, 10, {M_PI, 2 * M_PI, 3 * M_PI});
  expect_ones("exp(x)-2", -3, 3, {std::log(2.0)});
  expect_ones("x*y-z*x^2", 0.5, 3, {}, 100);
  expect_ones("x^2", 1, 3, {std::sqrt(4.5)}, 4.5);
  expect_ones("1/x", 0.1, 3, {0.5}, 2);
  expect_ones("atan2(x,y)", -1, 1, {0.25 * std::tan(0.5)}, 0.5);
  expect_ones("x^2.5", 0.1, 3, {std::pow(2, 0.4)}, 2);
  expect_ones("2^x", -1, 3, {1.5}, std::pow(2, 1.5));
}

TEST(LineRoots, NoneWhereThereIsNone) {
  for (const char* text : {"x^2+1e-12", "(x-0.3)^2+1e-13", "exp(x)", "cosh(x)-0.999999999", "sqrt(x^2+1e-6)-0.000999",
                           "max(x,0)+1e-9", "log(-1-x^2)", "sqrt(-1-x^2)", "asin(x^2+1.5)-2"})
    EXPECT_TRUE(roots_of(text, -1, 1).empty()) << text;
}

TEST(LineRoots, ClosePairsAreToldApart) {
  for (const double gap : {1e-3, 1e-5, 1e-6, 2e-7}) {
    for (const double at : {0.0, 0.3, 0.7071}) {
      const std::string text = fmt::format("(x-{:.17g})*(x-{:.17g})", at, at + gap);
      expect_ones(text, -1, 1, {at, at + gap});
      expect_ones(text + "*(x^4+y+3)", -1, 1, {at, at + gap});
    }
  }
  expect_ones("cos(x)-0.99999999", -0.5, 0.5, {-std::acos(0.99999999), std::acos(0.99999999)});
}

TEST(LineRoots, DoubleRootsStayOpen) {
  for (const double at : {0.0, 0.3, 0.7071}) {
    EXPECT_LT(flagged_width(fmt::format("(x-{0})^2", at), -1, 1, at, Kind::touching), 1e-6);
    EXPECT_LT(flagged_width(fmt::format("x^2-{:.17g}*x+{:.17g}", 2 * at, at * at), -1, 1, at, Kind::touching), 1e-6);
    EXPECT_LT(flagged_width(fmt::format("(x-{0})^3", at), -1, 1, at, Kind::touching), 1e-3);
  }
  EXPECT_LT(flagged_width("cos(x)+1", 2, 4, M_PI, Kind::touching), 1e-6);
}

TEST(LineRoots, EndsAreNotTold) {
  // A root at the very end of the stretch may be before or behind it.
  EXPECT_LT(flagged_width("x-1", 1, 2, 1, Kind::undecided), 1e-14);
  EXPECT_LT(flagged_width("x-2", 1, 2, 2, Kind::undecided), 1e-14);
  EXPECT_EQ(roots_of("0*x", 1, 2).size(), 1u);
  EXPECT_EQ(roots_of("0*x", 1, 2)[0].kind, Kind::undecided);
}

TEST(LineRoots, CreasesAreCrossedAndTouched) {
  expect_ones("x+0.5*abs(x)", -1, 2, {0});
  expect_ones("max(x,2*x)", -1, 2, {0});
  expect_ones("max(x-0.3,y-0.5)", -1, 1, {0.3});
  expect_ones("abs(x)-0.5", -1, 2, {-0.5, 0.5});
  expect_ones("abs(x)-1e-6", -1e-3, 2e-3, {-1e-6, 1e-6});
  EXPECT_LT(flagged_width("abs(x)", -1e-3, 2e-3, 0, Kind::touching), 1e-8);
  EXPECT_LT(flagged_width("min(x,-x)", -1e-3, 2e-3, 0, Kind::touching), 1e-8);
  EXPECT_TRUE(roots_of("abs(x)+1e-8", -1e-3, 2e-3).empty());
  // Where terms cancel the side is told by the slope.
  expect_ones("abs(x^2-x+0.25)-1e-10", 0.4999, 0.5002, {0.5 - 1e-5, 0.5 + 1e-5});
  expect_ones("max(x^2-x+0.25,1e-10*x)-1e-10", 0.4999, 0.5002, {0.5 - 1e-5, 0.5 + 1e-5});
}

TEST(LineRoots, PolesAndJumpsAreNoRoots) {
  // Signs change, values do not pass 0: nothing may be told that is proved.
  for (const char* text : {"1/x", "1/x^3", "tan(x+pi/2)", "floor(x)+0.5", "atan2(x-x,x)-1", "mod(x,1)-0.5"}) {
    for (const LineRoot& root : roots_of(text, -0.4, 0.4)) EXPECT_NE(root.kind, Kind::one) << text;
  }
  // And what is beside them is found.
  const std::vector<LineRoot> found = roots_of("1/x-2", -1, 1);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.back().kind, Kind::one);
  EXPECT_NEAR(found.back().low, 0.5, 1e-8);
  // Where the function ends, nothing is proved; elsewhere it is.
  for (const LineRoot& root : roots_of("sqrt(x)", -1, 1)) EXPECT_NE(root.kind, Kind::one);
  expect_ones("sqrt(x)-0.5", 0.01, 1, {0.25});
  expect_ones("log(x)", 0.5, 3, {1});
}

// Random expressions: the model's polynomial and its error hold everywhere, so that Taylor coefficients at the middle
// and over the stretch bound the function.
TEST(Series, EncloseRandomExpressions) {
  RandomTrees random(51);
  int compared = 0, sharp = 0;
  for (int n = 0; n < 4000; n++) {
    Graph graph;
    const NodeId root = random.tree(5).build(graph);
    const std::array roots{root};
    const Program program = make_program(graph, roots);
    const Point middle = random.point(2), along = random.point(1);
    const double half = std::exp2(random.uniform(-12, -2));
    std::vector<Series> nodes, scratch;
    const auto series = [&](double low, double high) {
      std::array<Series, 3> variables;
      for (std::size_t k = 0; k < 3; k++) {
        variables[k].at[0] = Bound{middle[k], middle[k]} + Bound{low, high} * Bound{along[k], along[k]};
        variables[k].at[1] = Bound{half, half} * Bound{along[k], along[k]};
      }
      const auto used = std::span<const Series>(variables).first(std::size_t(program.variables));
      return low == high ? evaluate(program, used, nodes) : evaluate(program, used, nodes, scratch);
    };
    const Series here = series(0, 0), all = series(-half, half);
    for (int i = 0; i < 5; i++) {
      const double s = random.uniform(-1, 1);
      Point p;
      for (std::size_t k = 0; k < 3; k++) p[k] = middle[k] + s * half * along[k];
      const double f = value_of(graph, root, p);
      EXPECT_TRUE(std::isnan(f) ? !all.defined : !all.nowhere)
          << f << " " << all.defined << all.nowhere << " [" << all.at[0].low << " " << all.at[0].high << "]";
      if (std::isnan(f) || !(std::abs(f) < 1e6)) continue;
      const double rounding = 1e-9 * (1 + std::abs(f));  // of the value in double, where terms may cancel
      compared++;
      ASSERT_GE(f, all.at[0].low - rounding);
      ASSERT_LE(f, all.at[0].high + rounding);
      if (!all.defined || !all.continuous) continue;
      // By the slope alone, and by each order.
      for (std::size_t order = 1; order <= series_order; order++) {
        Bound sum{0, 0};
        for (std::size_t k = 0; k <= order; k++) {
          const double power = std::pow(s, double(k));
          const Bound term = (k == order ? all : here).at[k] * Bound{power, power};
          sum = {sum.low + term.low, sum.high + term.high};
        }
        ASSERT_FALSE(f < sum.low - rounding) << "order " << order;
        ASSERT_FALSE(f > sum.high + rounding) << "order " << order;
        sharp += order == series_order && sum.high - sum.low < 1e-3 * half;
      }
    }
  }
  EXPECT_GT(compared, 8000);
  EXPECT_GT(sharp, 2000);
}

}  // namespace
}  // namespace smurf::expression
