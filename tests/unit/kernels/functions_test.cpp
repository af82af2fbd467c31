// Elementary functions of the kernels, run on the host lane by lane, against double within their stated errors.
#include "unit/kernels/kernel_operations.hpp"

namespace smurf {
namespace {

using RealFunction = float (*)(float);
using DoubleFunction = double (*)(double);

struct Elementary {
  const char* name;
  RealFunction fused, separate;
  DoubleFunction exact;
  double error, low, high;
};

#define ELEMENTARY(name, reference, error, low, high)                                                                \
  Elementary {                                                                                                       \
#name, ::fused::function_##name, ::separate::function_##name, [](double x) { return reference(x); }, error, low, \
                                                                                                      high           \
  }

const Elementary elementary[] = {
    ELEMENTARY(sin, std::sin, SIN_ERROR, -FUNCTION_TRIG_LIMIT, FUNCTION_TRIG_LIMIT),
    ELEMENTARY(cos, std::cos, COS_ERROR, -FUNCTION_TRIG_LIMIT, FUNCTION_TRIG_LIMIT),
    ELEMENTARY(tan, std::tan, TAN_ERROR, -FUNCTION_TRIG_LIMIT, FUNCTION_TRIG_LIMIT),
    ELEMENTARY(exp, std::exp, EXP_ERROR, -most, 88.7),
    ELEMENTARY(log, std::log, LOG_ERROR, NORMAL_REAL, most),
    ELEMENTARY(atan, std::atan, ATAN_ERROR, -most, most),
    ELEMENTARY(asin, std::asin, ASIN_ERROR, -1.0, 1.0),
    ELEMENTARY(acos, std::acos, ACOS_ERROR, -1.0, 1.0),
    ELEMENTARY(sinh, std::sinh, SINH_ERROR, -89.4, 89.4),
    ELEMENTARY(cosh, std::cosh, COSH_ERROR, -89.4, 89.4),
    ELEMENTARY(tanh, std::tanh, TANH_ERROR, -most, most),
    ELEMENTARY(sqrt, std::sqrt, SQRT_ERROR, NORMAL_REAL, most),
    ELEMENTARY(floor, std::floor, 0.0, -most, most),
};

// The part of an error that is not absolute, in units of ROUNDING.
double relative_error(double computed, double exact) {
  const double beyond = std::fabs(computed - exact) - tiny;
  return beyond <= 0 ? 0.0 : beyond / (std::fabs(exact) * rounding);
}

struct Worst {
  double error = 0, at = 0;
  void see(double e, double x) {
    if (!(e <= error)) error = e, at = x;
  }
};

TEST(KernelFunctions, KeepTheirStatedErrors) {
  const std::uint64_t stride = std::max(1, 3001 / density());
  for (const Elementary& function : elementary) {
    Worst worst;
    for (const bool flushed : {false, true}) {
      const Flushing flushing(flushed);
      for (std::uint64_t bits = 0; bits < (std::uint64_t{1} << 32); bits += stride) {
        const float x = one_lane::as_real(static_cast<std::uint32_t>(bits));
        if (!(x >= function.low && x <= function.high)) continue;
        if (std::fabs(x) < NORMAL_REAL) continue;
        const double exact = function.exact(x);
        worst.see(relative_error(function.fused(x), exact), x);
        worst.see(relative_error(function.separate(x), exact), x);
      }
    }
    RecordProperty(function.name, std::to_string(worst.error));
    // What is left of the stated error, other devices may need for their divisions and square roots.
    EXPECT_LE(worst.error, function.error) << function.name << " at " << worst.at;
    if (density() > 1) std::printf("%-20s %.3f of %.0f at %a\n", function.name, worst.error, function.error, worst.at);
  }
}

// The floats next to multiples of pi/2, where reduction cancels most.
TEST(KernelFunctions, TrigonometryHoldsNextToItsZeros) {
  const double half_pi = 1.5707963267948966;
  Worst sine, cosine, tangent;
  for (int n = -5215; n <= 5215; n++) {
    float x = static_cast<float>(n * half_pi);
    x = std::nextafter(std::nextafter(x, -1e9f), -1e9f);
    for (int step = 0; step < 5; step++, x = std::nextafter(x, 1e9f)) {
      if (std::fabs(x) > FUNCTION_TRIG_LIMIT || std::fabs(x) < NORMAL_REAL) continue;
      sine.see(relative_error(::separate::function_sin(x), std::sin(double{x})), x);
      cosine.see(relative_error(::separate::function_cos(x), std::cos(double{x})), x);
      tangent.see(relative_error(::separate::function_tan(x), std::tan(double{x})), x);
    }
  }
  EXPECT_LE(sine.error, SIN_ERROR) << sine.at;
  EXPECT_LE(cosine.error, COS_ERROR) << cosine.at;
  EXPECT_LE(tangent.error, TAN_ERROR) << tangent.at;
}

TEST(KernelFunctions, PowersAndAnglesKeepTheirStatedErrors) {
  Random random(1);
  Worst angle, power, whole;
  for (int i = 0; i < 300000 * density(); i++) {
    const double spread = random.below(3) ? 3.0 : 120.0;
    const float x = static_cast<float>(random.sized(-spread, spread)),
                y = static_cast<float>(random.sized(-spread, spread));
    angle.see(relative_error(::separate::function_atan2(y, x), std::atan2(double{y}, double{x})), x);
    angle.see(relative_error(::fused::function_atan2(y, x), std::atan2(double{y}, double{x})), x);
    const float base = std::fabs(x), exponent = static_cast<float>(random.uniform(-4, 4));
    const double exact = std::pow(double{base}, double{exponent});
    if (exact < 3e38 && exact > 2e-38) {
      const double stated = POW_ERROR + POWER_ERROR_SLOPE * std::fabs(exponent * std::log(double{base}));
      power.see(relative_error(::separate::function_pow(base, exponent), exact) / stated, base);
    }
    const int n = random.below(9);
    const double exact_whole = std::pow(double{x}, n);
    if (std::fabs(exact_whole) < 3e38) {
      whole.see(relative_error(::separate::function_power_integer(x, n), exact_whole) / std::max(1, n - 1), x);
    }
  }
  EXPECT_LE(angle.error, ATAN2_ERROR) << angle.at;
  EXPECT_LE(power.error, 1.0) << power.at;
  EXPECT_LE(whole.error, 1.001) << whole.at;
  if (density() > 1)
    std::printf("arctangent2 %.3f, power %.3f of the stated, power_integer %.3f\n", angle.error, power.error,
                whole.error);
}

TEST(KernelFunctions, CheckedFunctionsSayWhatIsNotDefined) {
  using namespace ::separate;
  for (const float x : {checked_divide(1, 0),
                        checked_sqrt(-1),
                        checked_log(0),
                        checked_log(-1),
                        checked_asin(1.5f),
                        checked_acos(-1.5f),
                        checked_pow(-1, 2),
                        checked_pow(0, 0),
                        checked_power_integer(0, -1),
                        checked_mod(1, 0),
                        checked_sin(9000),
                        checked_min(not_a_number(), 1),
                        checked_choose(1, not_a_number(), 2, 3),
                        checked_atan2(not_a_number(), 1),
                        function_floor(not_a_number()),
                        function_exp(not_a_number()),
                        function_sinh(not_a_number()),
                        function_tanh(not_a_number()),
                        function_sign(not_a_number()),
                        function_atan(not_a_number())}) {
    EXPECT_TRUE(std::isnan(x));
  }
  EXPECT_EQ(checked_pow(0, 2), 0);
  EXPECT_EQ(checked_mod(-0.25f, 1), 0.75f);
  EXPECT_EQ(checked_mod(5.5f, -2), -0.5f);
  EXPECT_EQ(checked_power_integer(-2, -3), -0.125f);
  EXPECT_EQ(function_exp(100), std::numeric_limits<float>::infinity());
  EXPECT_EQ(function_exp(-110), 0);
  EXPECT_EQ(function_floor(-0.5f), -1);
  EXPECT_EQ(function_floor(-3e38f), -3e38f);
}

}  // namespace
}  // namespace smurf
