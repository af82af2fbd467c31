// One generated expression in every number type of the kernels: they agree with each other and with double.
#include "unit/kernels/kernel_operations.hpp"

#define CHOICES 1

// One generated expression in all number types. It touches every operation, and is defined wherever x > 0.1 and y > 0.
#define GENERATED                                                                                \
  FN NUMBER generated(NUMBER x, NUMBER y) {                                                      \
    NUMBER a = OP_ADD(OP_SIN(x), OP_MULTIPLY_CONSTANT(OP_COS(y), 0.5f));                         \
    NUMBER b = OP_SUBTRACT(OP_EXP(OP_NEGATE(x)), OP_LOG(OP_ADD_CONSTANT(y, 1.0f)));              \
    NUMBER c = OP_DIVIDE(OP_MULTIPLY(a, b), OP_ADD_CONSTANT(OP_POWER_INTEGER(x, 2), 1.0f));      \
    NUMBER d = OP_POW(x, OP_CONSTANT(1.5f));                                                     \
    NUMBER e = OP_ATAN2(OP_SQRT(y), OP_ADD(x, OP_ABS(c)));                                       \
    NUMBER f = OP_TAN(OP_MULTIPLY_CONSTANT(OP_TANH(d), 0.25f));                                  \
    NUMBER g = OP_ASIN(OP_MULTIPLY_CONSTANT(OP_SIN(y), 0.75f));                                  \
    NUMBER h = OP_ACOS(OP_MULTIPLY_CONSTANT(OP_COS(x), 0.75f));                                  \
    NUMBER i = OP_COSH(OP_ATAN(OP_SINH(c)));                                                     \
    NUMBER j = OP_MIN(OP_ADD(f, g), OP_MAX(h, i));                                               \
    NUMBER k = OP_ADD(OP_FLOOR(OP_MULTIPLY_CONSTANT(x, 0.0625f)), OP_SIGN(y));                   \
    NUMBER l = OP_CHOOSE(x, OP_CONSTANT(64.0f), OP_MOD(j, OP_CONSTANT(50.0f)), e);               \
    return OP_ADD(OP_ADD(j, k), OP_ADD(l, e));                                                   \
  }                                                                                              \
  FN NUMBER inexact_sum(NUMBER x) { return OP_ADD_INEXACT(x, -0.1f, 0x1p-27f); }                 \
  FN NUMBER inexact_difference(NUMBER x) { return OP_SUBTRACT(x, OP_INEXACT(0.1f, -0x1p-27f)); } \
  FN NUMBER inexact_product(NUMBER x) { return OP_MULTIPLY_INEXACT(x, -0.1f, 0x1p-27f); }

namespace in_interval_duals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/interval_dual_number.inc"
GENERATED
}  // namespace in_interval_duals
namespace in_intervals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/interval_number.inc"
GENERATED
}  // namespace in_intervals
namespace in_bounded {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/bounded_number.inc"
GENERATED
}  // namespace in_bounded
namespace in_reals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/real_number.inc"
GENERATED
}  // namespace in_reals
namespace in_duals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/dual.inc"
GENERATED
}  // namespace in_duals

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

TEST(KernelNumberTypes, AgreeOnAGeneratedExpression) {
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
    const auto slopes = in_interval_duals::generated(
        in_interval_duals::interval_dual_make(box(in_interval_duals::interval_make, x, dx),
                                              box(in_interval_duals::interval_make, dx, 0)),
        in_interval_duals::interval_dual_make(box(in_interval_duals::interval_make, y, dy),
                                              box(in_interval_duals::interval_make, dy, 0)));
    ASSERT_TRUE(values.defined);
    ASSERT_EQ(values.low, slopes.value.low);
    ASSERT_EQ(values.high, slopes.value.high);
    const auto exact = [&](double t) { return generated(x + dx * t, y + dy * t); };
    const auto rounded =
        in_bounded::generated(in_bounded::bounded_exact(float(x)), in_bounded::bounded_exact(float(y)));
    if (in_bounded::bounded_known(rounded)) {
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
      const auto dual = in_duals::generated(in_duals::dual_make(fx, static_cast<float>(dx)),
                                            in_duals::dual_make(fy, static_cast<float>(dy)));
      ASSERT_GE(dual.slope, slopes.slope.low - 1e-4);
      ASSERT_LE(dual.slope, slopes.slope.high + 1e-4);
      ASSERT_NEAR(in_reals::generated(fx, fy), exact(0), 1e-4);
      ASSERT_EQ(in_reals::generated(fx, fy), dual.value);
    }
  }
  EXPECT_GT(with_slope, 10000);
  EXPECT_GT(with_error, 19000);
  EXPECT_LT(largest_error, 51);  // at the jumps of floor and modulo
}

// Near the float that an inexact constant is rounded to, what is left of a difference is the rounding.
TEST(KernelNumberTypes, InexactConstantsAreEnclosed) {
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
    const auto rising = in_interval_duals::interval_dual_make(in_interval_duals::interval_point(x),
                                                              in_interval_duals::interval_point(1));
    for (const auto& d : {in_interval_duals::inexact_sum(rising), in_interval_duals::inexact_difference(rising)})
      EXPECT_TRUE(contains(d.value.low, d.value.high, left)) << x;
    const auto turned = in_interval_duals::inexact_product(rising);
    EXPECT_TRUE(contains(turned.value.low, turned.value.high, product));
    EXPECT_TRUE(contains(turned.slope.low, turned.slope.high, -0.1));
    for (const auto& r : {in_bounded::inexact_sum(in_bounded::bounded_exact(x)),
                          in_bounded::inexact_difference(in_bounded::bounded_exact(x))}) {
      EXPECT_TRUE(contains(double{r.value} - r.error, double{r.value} + r.error, left)) << x;
      EXPECT_LT(r.error, 4e-8f);
    }
    const auto r = in_bounded::inexact_product(in_bounded::bounded_exact(x));
    EXPECT_TRUE(contains(double{r.value} - r.error, double{r.value} + r.error, product));
    EXPECT_EQ(in_reals::inexact_sum(x), x - 0.1f);
    EXPECT_EQ(in_duals::inexact_product(in_duals::dual_make(x, 1)).slope, -0.1f);
  }
}

}  // namespace
}  // namespace smurf
