// One generated expression in every vocabulary of the kernels: they agree with each other and with double.
#include "harness/kernel_operations.hpp"

#define CHOICES 1

// One generated expression in all vocabularies. It touches every word, and is defined wherever x > 0.1 and y > 0.
#define GENERATED                                                                                 \
  FN NUMBER generated(NUMBER x, NUMBER y) {                                                       \
    NUMBER a = OP_ADD(OP_SINE(x), OP_MULTIPLY_CONSTANT(OP_COSINE(y), 0.5f));                      \
    NUMBER b = OP_SUBTRACT(OP_EXPONENTIAL(OP_NEGATE(x)), OP_LOGARITHM(OP_ADD_CONSTANT(y, 1.0f))); \
    NUMBER c = OP_DIVIDE(OP_MULTIPLY(a, b), OP_ADD_CONSTANT(OP_POWER_INTEGER(x, 2), 1.0f));       \
    NUMBER d = OP_POWER(x, OP_CONSTANT(1.5f));                                                    \
    NUMBER e = OP_ARCTANGENT2(OP_SQUARE_ROOT(y), OP_ADD(x, OP_ABSOLUTE(c)));                      \
    NUMBER f = OP_TANGENT(OP_MULTIPLY_CONSTANT(OP_HYPERBOLIC_TANGENT(d), 0.25f));                 \
    NUMBER g = OP_ARCSINE(OP_MULTIPLY_CONSTANT(OP_SINE(y), 0.75f));                               \
    NUMBER h = OP_ARCCOSINE(OP_MULTIPLY_CONSTANT(OP_COSINE(x), 0.75f));                           \
    NUMBER i = OP_HYPERBOLIC_COSINE(OP_ARCTANGENT(OP_HYPERBOLIC_SINE(c)));                        \
    NUMBER j = OP_MINIMUM(OP_ADD(f, g), OP_MAXIMUM(h, i));                                        \
    NUMBER k = OP_ADD(OP_FLOOR(OP_MULTIPLY_CONSTANT(x, 0.0625f)), OP_SIGN(y));                    \
    NUMBER l = OP_CHOOSE(x, OP_CONSTANT(64.0f), OP_MODULO(j, OP_CONSTANT(50.0f)), e);             \
    return OP_ADD(OP_ADD(j, k), OP_ADD(l, e));                                                    \
  }                                                                                               \
  FN NUMBER inexact_sum(NUMBER x) { return OP_ADD_INEXACT(x, -0.1f, 0x1p-27f); }                  \
  FN NUMBER inexact_difference(NUMBER x) { return OP_SUBTRACT(x, OP_INEXACT(0.1f, -0x1p-27f)); }  \
  FN NUMBER inexact_product(NUMBER x) { return OP_MULTIPLY_INEXACT(x, -0.1f, 0x1p-27f); }

namespace in_duals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/interval_dual_vocabulary.inc"
GENERATED
}  // namespace in_duals
namespace in_intervals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/interval_vocabulary.inc"
GENERATED
}  // namespace in_intervals
namespace in_rounded {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/running_error_vocabulary.inc"
GENERATED
}  // namespace in_rounded
namespace in_reals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/real_vocabulary.inc"
GENERATED
}  // namespace in_reals
namespace in_real_duals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/dual.inc"
GENERATED
}  // namespace in_real_duals

namespace smurf {
namespace {

double generated(double x, double y) {
  const double a = std::sin(x) + 0.5 * std::cos(y);
  const double b = std::exp(-x) - std::log(y + 1);
  const double c = a * b / (x * x + 1);
  const double d = std::pow(x, 1.5);
  const double e = std::atan2(std::sqrt(y), x + std::fabs(c));
  const double f = std::tan(0.25 * std::tanh(d));
  const double g = std::asin(0.75 * std::sin(y));
  const double h = std::acos(0.75 * std::cos(x));
  const double i = std::cosh(std::atan(std::sinh(c)));
  const double j = std::min(f + g, std::max(h, i));
  const double k = std::floor(0.0625 * x) + sign(y);
  const double l = x <= 64 ? modulo(j, 50) : e;
  return j + k + l + e;
}

TEST(KernelVocabularies, AgreeOnAGeneratedExpression) {
  Random random(3);
  int with_slope = 0, with_error = 0;
  float largest_error = 0;
  for (int n = 0; n < 20000; n++) {
    const double x = random.uniform(0.2, 80), y = random.uniform(0.1, 20), dx = random.uniform(-1, 1),
                 dy = random.uniform(-1, 1);
    const double extent = std::exp2(random.uniform(-16, -4));
    const auto box = [&](auto make, double from, double rise) {
      const double to = from + rise * extent;
      return make(std::nextafter(static_cast<float>(std::min(from, to)), -1e9f),
                  std::nextafter(static_cast<float>(std::max(from, to)), 1e9f));
    };
    const auto values =
        in_intervals::generated(box(in_intervals::interval_make, x, dx), box(in_intervals::interval_make, y, dy));
    const auto slopes = in_duals::generated(
        in_duals::dual_make(box(in_duals::interval_make, x, dx), box(in_duals::interval_make, dx, 0)),
        in_duals::dual_make(box(in_duals::interval_make, y, dy), box(in_duals::interval_make, dy, 0)));
    ASSERT_TRUE(values.defined);
    ASSERT_EQ(values.low, slopes.value.low);
    ASSERT_EQ(values.high, slopes.value.high);
    const auto exact = [&](double t) { return generated(x + dx * t, y + dy * t); };
    const auto rounded =
        in_rounded::generated(in_rounded::rounded_exact(float(x)), in_rounded::rounded_exact(float(y)));
    if (in_rounded::rounded_known(rounded)) {
      with_error++;
      ASSERT_LE(std::fabs(rounded.value - generated(double{float(x)}, double{float(y)})), rounded.error);
      largest_error = std::max(largest_error, rounded.error);
    }
    const double t = extent * random.uniform(0, 1), s = extent * random.uniform(0, 1);
    ASSERT_GE(exact(t), values.low);
    ASSERT_LE(exact(t), values.high);
    const float fx = static_cast<float>(x), fy = static_cast<float>(y);
    if (slopes.smooth_here && slopes.slope.defined) {
      with_slope++;
      const double quotient = (exact(s) - exact(t)) / (s - t), tolerance = 1e-13 / std::fabs(s - t);
      ASSERT_GE(quotient, slopes.slope.low - tolerance);
      ASSERT_LE(quotient, slopes.slope.high + tolerance);
      const auto real_dual = in_real_duals::generated(in_real_duals::real_dual_make(fx, static_cast<float>(dx)),
                                                      in_real_duals::real_dual_make(fy, static_cast<float>(dy)));
      ASSERT_GE(real_dual.slope, slopes.slope.low - 1e-4);
      ASSERT_LE(real_dual.slope, slopes.slope.high + 1e-4);
      ASSERT_NEAR(in_reals::generated(fx, fy), exact(0), 1e-4);
      ASSERT_EQ(in_reals::generated(fx, fy), real_dual.value);
    }
  }
  EXPECT_GT(with_slope, 10000);
  EXPECT_GT(with_error, 19000);
  EXPECT_LT(largest_error, 51);  // at the jumps of floor and modulo
}

// Near the float that an inexact constant is rounded to, what is left of a difference is the rounding.
TEST(KernelVocabularies, InexactConstantsAreEnclosed) {
  Random random(4);
  for (int n = 0; n < 2000; n++) {
    const float x = n == 0 ? 0.1f : float(0.1 + random.uniform(-1e-7, 1e-7));
    const double left = double(x) - 0.1, product = -0.1 * double(x);
    const auto contains = [](double low, double high, double value) { return low <= value && value <= high; };
    for (const auto& i : {in_intervals::inexact_sum(in_intervals::interval_point(x)),
                          in_intervals::inexact_difference(in_intervals::interval_point(x))}) {
      EXPECT_TRUE(contains(i.low, i.high, left)) << x;
      EXPECT_LT(i.high - i.low, 4e-8f);
    }
    const auto rising = in_duals::dual_make(in_duals::interval_point(x), in_duals::interval_point(1));
    for (const auto& d : {in_duals::inexact_sum(rising), in_duals::inexact_difference(rising)})
      EXPECT_TRUE(contains(d.value.low, d.value.high, left)) << x;
    const auto turned = in_duals::inexact_product(rising);
    EXPECT_TRUE(contains(turned.value.low, turned.value.high, product));
    EXPECT_TRUE(contains(turned.slope.low, turned.slope.high, -0.1));
    for (const auto& r : {in_rounded::inexact_sum(in_rounded::rounded_exact(x)),
                          in_rounded::inexact_difference(in_rounded::rounded_exact(x))}) {
      EXPECT_TRUE(contains(double{r.value} - r.error, double{r.value} + r.error, left)) << x;
      EXPECT_LT(r.error, 4e-8f);
    }
    const auto r = in_rounded::inexact_product(in_rounded::rounded_exact(x));
    EXPECT_TRUE(contains(double{r.value} - r.error, double{r.value} + r.error, product));
    EXPECT_EQ(in_reals::inexact_sum(x), x - 0.1f);
    EXPECT_EQ(in_real_duals::inexact_product(in_real_duals::real_dual_make(x, 1)).slope, -0.1f);
  }
}

}  // namespace
}  // namespace smurf
