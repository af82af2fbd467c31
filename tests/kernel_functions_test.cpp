// Device code of expressions, run on the host lane by lane: elementary functions against double within their stated
// errors, intervals against double at random points within them, slopes against difference quotients.
//
// Each runs with multiply_add fused and not, and with denormals kept and flushed where the processor can do that.
// SMURF_TEST_DENSE=20 makes the samples that many times denser.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "harness/one_lane.hpp"

namespace fused {
using namespace one_lane;
using one_lane::fused::multiply_add;
#include "kernels/core/dual_interval.inc"
}  // namespace fused
namespace separate {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/dual_interval.inc"
}  // namespace separate

#define CHOICES 1
namespace errors_fused {
using namespace one_lane;
using one_lane::fused::multiply_add;
#include "kernels/core/rounded.inc"
}  // namespace errors_fused
namespace errors_separate {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/rounded.inc"
}  // namespace errors_separate

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
  }

namespace in_duals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/dual_vocabulary.inc"
GENERATED
}  // namespace in_duals
namespace in_intervals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/interval_vocabulary.inc"
GENERATED
}  // namespace in_intervals
namespace in_rounded {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/rounded_vocabulary.inc"
GENERATED
}  // namespace in_rounded
namespace in_reals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/real_vocabulary.inc"
GENERATED
}  // namespace in_reals
namespace in_real_duals {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/core/real_dual_vocabulary.inc"
GENERATED
}  // namespace in_real_duals

namespace smurf {
namespace {

constexpr double kRounding = 0x1p-24;
constexpr double kTiny = TINY_REAL;
constexpr double kHuge = HUGE_REAL;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

int dense() {
  const char* wanted = std::getenv("SMURF_TEST_DENSE");
  return wanted ? std::max(1, std::atoi(wanted)) : 1;
}

// Denormals are flushed, as operands and as results, while this lives.
class Flushing {
 public:
  explicit Flushing([[maybe_unused]] bool wanted) {
#if defined(__SSE2__)
    before_ = _mm_getcsr();
    if (wanted) _mm_setcsr(before_ | 0x8040);
#endif
  }
  ~Flushing() {
#if defined(__SSE2__)
    _mm_setcsr(before_);
#endif
  }
  Flushing(const Flushing&) = delete;
  Flushing& operator=(const Flushing&) = delete;

 private:
  [[maybe_unused]] unsigned before_ = 0;
};

// ---- Elementary functions.

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

constexpr double kMost = std::numeric_limits<float>::max();
const Elementary kElementary[] = {
    ELEMENTARY(sine, std::sin, SINE_ERROR, -FUNCTION_TRIG_LIMIT, FUNCTION_TRIG_LIMIT),
    ELEMENTARY(cosine, std::cos, COSINE_ERROR, -FUNCTION_TRIG_LIMIT, FUNCTION_TRIG_LIMIT),
    ELEMENTARY(tangent, std::tan, TANGENT_ERROR, -FUNCTION_TRIG_LIMIT, FUNCTION_TRIG_LIMIT),
    ELEMENTARY(exponential, std::exp, EXPONENTIAL_ERROR, -kMost, 88.7),
    ELEMENTARY(logarithm, std::log, LOGARITHM_ERROR, NORMAL_REAL, kMost),
    ELEMENTARY(arctangent, std::atan, ARCTANGENT_ERROR, -kMost, kMost),
    ELEMENTARY(arcsine, std::asin, ARCSINE_ERROR, -1.0, 1.0),
    ELEMENTARY(arccosine, std::acos, ARCCOSINE_ERROR, -1.0, 1.0),
    ELEMENTARY(hyperbolic_sine, std::sinh, HYPERBOLIC_SINE_ERROR, -89.4, 89.4),
    ELEMENTARY(hyperbolic_cosine, std::cosh, HYPERBOLIC_COSINE_ERROR, -89.4, 89.4),
    ELEMENTARY(hyperbolic_tangent, std::tanh, HYPERBOLIC_TANGENT_ERROR, -kMost, kMost),
    ELEMENTARY(square_root, std::sqrt, SQUARE_ROOT_ERROR, NORMAL_REAL, kMost),
    ELEMENTARY(floor, std::floor, 0.0, -kMost, kMost),
};

// The part of an error that is not absolute, in units of ROUNDING.
double relative_error(double computed, double exact) {
  const double beyond = std::fabs(computed - exact) - kTiny;
  return beyond <= 0 ? 0.0 : beyond / (std::fabs(exact) * kRounding);
}

struct Worst {
  double error = 0, at = 0;
  void see(double e, double x) {
    if (!(e <= error)) error = e, at = x;
  }
};

TEST(KernelFunctions, KeepTheirStatedErrors) {
  const std::uint64_t stride = std::max(1, 3001 / dense());
  for (const Elementary& function : kElementary) {
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
    if (dense() > 1) std::printf("%-20s %.3f of %.0f at %a\n", function.name, worst.error, function.error, worst.at);
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
      sine.see(relative_error(::separate::function_sine(x), std::sin(double{x})), x);
      cosine.see(relative_error(::separate::function_cosine(x), std::cos(double{x})), x);
      tangent.see(relative_error(::separate::function_tangent(x), std::tan(double{x})), x);
    }
  }
  EXPECT_LE(sine.error, SINE_ERROR) << sine.at;
  EXPECT_LE(cosine.error, COSINE_ERROR) << cosine.at;
  EXPECT_LE(tangent.error, TANGENT_ERROR) << tangent.at;
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) { return low + (high - low) * uniform_(engine_); }
  int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }
  double sign() { return below(2) ? 1.0 : -1.0; }
  // Of any size between 2^least and 2^most.
  double sized(double least, double most) { return sign() * std::exp2(uniform(least, most)); }

 private:
  std::mt19937 engine_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

TEST(KernelFunctions, PowersAndAnglesKeepTheirStatedErrors) {
  Random random(1);
  Worst angle, power, whole;
  for (int i = 0; i < 300000 * dense(); i++) {
    const double spread = random.below(3) ? 3.0 : 120.0;
    const float x = static_cast<float>(random.sized(-spread, spread)),
                y = static_cast<float>(random.sized(-spread, spread));
    angle.see(relative_error(::separate::function_arctangent2(y, x), std::atan2(double{y}, double{x})), x);
    angle.see(relative_error(::fused::function_arctangent2(y, x), std::atan2(double{y}, double{x})), x);
    const float base = std::fabs(x), exponent = static_cast<float>(random.uniform(-4, 4));
    const double exact = std::pow(double{base}, double{exponent});
    if (exact < 3e38 && exact > 2e-38) {
      const double stated = POWER_ERROR + POWER_ERROR_SLOPE * std::fabs(exponent * std::log(double{base}));
      power.see(relative_error(::separate::function_power(base, exponent), exact) / stated, base);
    }
    const int n = random.below(9);
    const double exact_whole = std::pow(double{x}, n);
    if (std::fabs(exact_whole) < 3e38) {
      whole.see(relative_error(::separate::function_power_integer(x, n), exact_whole) / std::max(1, n - 1), x);
    }
  }
  EXPECT_LE(angle.error, ARCTANGENT2_ERROR) << angle.at;
  EXPECT_LE(power.error, 1.0) << power.at;
  EXPECT_LE(whole.error, 1.001) << whole.at;
  if (dense() > 1)
    std::printf("arctangent2 %.3f, power %.3f of the stated, power_integer %.3f\n", angle.error, power.error,
                whole.error);
}

TEST(KernelFunctions, CheckedFunctionsSayWhatIsNotDefined) {
  using namespace ::separate;
  for (const float x : {checked_divide(1, 0),
                        checked_square_root(-1),
                        checked_logarithm(0),
                        checked_logarithm(-1),
                        checked_arcsine(1.5f),
                        checked_arccosine(-1.5f),
                        checked_power(-1, 2),
                        checked_power(0, 0),
                        checked_power_integer(0, -1),
                        checked_modulo(1, 0),
                        checked_sine(9000),
                        checked_minimum(not_a_number(), 1),
                        checked_choose(1, not_a_number(), 2, 3),
                        checked_arctangent2(not_a_number(), 1),
                        function_floor(not_a_number()),
                        function_exponential(not_a_number()),
                        function_hyperbolic_sine(not_a_number()),
                        function_hyperbolic_tangent(not_a_number()),
                        function_sign(not_a_number()),
                        function_arctangent(not_a_number())}) {
    EXPECT_TRUE(std::isnan(x));
  }
  EXPECT_EQ(checked_power(0, 2), 0);
  EXPECT_EQ(checked_modulo(-0.25f, 1), 0.75f);
  EXPECT_EQ(checked_modulo(5.5f, -2), -0.5f);
  EXPECT_EQ(checked_power_integer(-2, -3), -0.125f);
  EXPECT_EQ(function_exponential(100), std::numeric_limits<float>::infinity());
  EXPECT_EQ(function_exponential(-110), 0);
  EXPECT_EQ(function_floor(-0.5f), -1);
  EXPECT_EQ(function_floor(-3e38f), -3e38f);
}

// ---- Intervals.

template <class Interval>
struct Operation {
  const char* name;
  std::function<Interval(Interval, Interval, Interval, Interval)> enclose;
  std::function<double(double, double, double, double)> exact;  // not a number where undefined
  int operands;
};

double defined_if(bool defined, double value) { return defined ? value : kUndefined; }
// a - b * floor(a / b), exact where double can hold it.
double modulo(double a, double b) {
  const double rest = std::fmod(a, b);
  return defined_if(b != 0, rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest);
}
double sign(double x) { return x > 0 ? 1.0 : (x < 0 ? -1.0 : 0.0); }
double whole_power(double a, int n) { return defined_if(n >= 0 || a != 0, std::pow(a, n)); }
double power(double a, double b) { return defined_if(a > 0 || (a == 0 && b > 0), std::pow(a, b)); }

#define ONE(name, value)                                                                          \
  {                                                                                               \
#name, [](I a, I, I, I) { return (void)a, PREFIX(name)(a); }, [](double a, double, double,    \
                                                                     double) { return value; }, 1 \
  }
#define TWO(name, value)                                                                                               \
  {                                                                                                                    \
#name, [](I a, I b, I, I) { return PREFIX(name)(a, b); },                                                          \
                                                           [](double a, double b, double, double) { return value; }, 2 \
  }
#define WITH(name, number, value)                                                                            \
  {                                                                                                          \
#name " " #number, [](I a, I, I, I) { return PREFIX(name)(a, number); }, [](double a, double, double,    \
                                                                                double) { return value; }, 1 \
  }

#define OPERATIONS                                                                                                     \
  TWO(add, a + b), TWO(subtract, a - b), TWO(multiply, a* b), TWO(divide, defined_if(b != 0, a / b)), ONE(negate, -a), \
      ONE(absolute, std::fabs(a)), ONE(square, a* a), WITH(power_integer, 0, 1 + 0 * a), WITH(power_integer, 1, a),    \
      WITH(power_integer, 2, a* a), WITH(power_integer, 3, whole_power(a, 3)),                                         \
      WITH(power_integer, 4, whole_power(a, 4)), WITH(power_integer, 7, whole_power(a, 7)),                            \
      WITH(power_integer, -1, whole_power(a, -1)), WITH(power_integer, -2, whole_power(a, -2)),                        \
      WITH(power_integer, -5, whole_power(a, -5)), TWO(power, power(a, b)),                                            \
      ONE(square_root, defined_if(a >= 0, std::sqrt(a))), ONE(exponential, std::exp(a)),                               \
      ONE(logarithm, defined_if(a > 0, std::log(a))), ONE(sine, std::sin(a)), ONE(cosine, std::cos(a)),                \
      ONE(tangent, std::tan(a)), ONE(arcsine, std::asin(a)), ONE(arccosine, std::acos(a)),                             \
      ONE(arctangent, std::atan(a)), TWO(arctangent2, defined_if(a != 0 || b != 0, std::atan2(a + 0.0, b))),           \
      ONE(hyperbolic_sine, std::sinh(a)), ONE(hyperbolic_cosine, std::cosh(a)), ONE(hyperbolic_tangent, std::tanh(a)), \
      TWO(minimum, std::min(a, b)), TWO(maximum, std::max(a, b)), ONE(floor, std::floor(a)), ONE(sign, sign(a)),       \
      TWO(modulo, modulo(a, b)), WITH(add_constant, -0.3f, a + double{-0.3f}),                                         \
      WITH(multiply_constant, -0.3f, a* double{-0.3f}), WITH(multiply_constant, 1e20f, a* double{1e20f}),              \
      WITH(multiply_constant, 1e-42f, a* double{1e-42f}), {                                                            \
    "choose", [](I a, I b, I c, I d) { return PREFIX(choose)(a, b, c, d); },                                           \
        [](double a, double b, double c, double d) { return a <= b ? c : d; }, 4                                       \
  }

#define PREFIX(name) ::fused::interval_##name
std::vector<Operation<::fused::Interval>> fused_intervals() {
  using I = ::fused::Interval;
  return {OPERATIONS};
}
#undef PREFIX
#define PREFIX(name) ::separate::interval_##name
std::vector<Operation<::separate::Interval>> separate_intervals() {
  using I = ::separate::Interval;
  return {OPERATIONS};
}
#undef PREFIX

struct Range {
  float low, high;
};

Range ordered(double a, double b) {
  const float low = static_cast<float>(std::clamp(std::min(a, b), -kMost, kMost));
  const float high = static_cast<float>(std::clamp(std::max(a, b), -kMost, kMost));
  return {low, high};
}

// Of all sizes and widths: points, narrow and wide ones, across and at zero, denormal, next to overflow, unbounded.
Range random_range(Random& random) {
  static const double special[] = {0,
                                   1,
                                   -1,
                                   0.5,
                                   -0.5,
                                   2,
                                   1.5707963267948966,
                                   3.141592653589793,
                                   1e-45,
                                   -1e-42,
                                   1e-38,
                                   -1.2e-38,
                                   9e-38,
                                   3e38,
                                   -3e38,
                                   3.4e38,
                                   -3.4e38,
                                   88.72283935,
                                   -87.3,
                                   8192,
                                   -8192,
                                   64,
                                   -103.9,
                                   1.0000001,
                                   1e30,
                                   -1e30,
                                   1e-20,
                                   16777216.0};
  const auto pick = [&] { return special[random.below(std::size(special))]; };
  switch (random.below(9)) {
    case 0: {
      const double center = random.uniform(-10, 10), width = std::exp2(random.uniform(-30, 3));
      return ordered(center - width, center + width);
    }
    case 1: {
      const double point = random.below(2) ? random.uniform(-10, 10) : random.sized(-149, 128);
      return ordered(point, point);
    }
    case 2: {
      const double center = random.sized(-149, 128);
      return ordered(center, center * (1 + random.sized(-24, 2)));
    }
    case 3:
      return ordered(-std::fabs(random.sized(-149, 128)), std::fabs(random.sized(-149, 128)));
    case 4:
      return ordered(-std::fabs(random.sized(-20, 4)), std::fabs(random.sized(-20, 4)));
    case 5:
      return ordered(pick(), pick());
    case 6:
      return ordered(pick(), random.uniform(-10, 10));
    case 7:
      return ordered(random.sized(-149, 128), random.sized(-149, 128));
    default: {
      const double center = random.uniform(-4, 14), width = std::exp2(random.uniform(-20, 14));
      return ordered(center - width, center + width);
    }
  }
}

// A number within the range; HUGE_REAL and more stand for anything beyond.
double random_inside(Random& random, Range range) {
  const double low = range.low <= -kHuge ? -std::exp2(random.uniform(128, 1000)) : range.low;
  const double high = range.high >= kHuge ? std::exp2(random.uniform(128, 1000)) : range.high;
  if (low == high) return low;
  switch (random.below(6)) {
    case 0:
      return low;
    case 1:
      return high;
    case 2:
    case 3: {  // all sizes alike
      if (low < 0 && high > 0) {
        const double end = random.below(2) ? low : high;
        return end * std::exp2(-random.uniform(0, 150));
      }
      const double near = std::min(std::fabs(low), std::fabs(high)), far = std::max(std::fabs(low), std::fabs(high));
      const double size =
          std::clamp(std::exp2(random.uniform(std::log2(std::max(near, far * 0x1p-100)), std::log2(far))), near, far);
      return high <= 0 ? -size : size;
    }
    default:
      return std::clamp(low + (high - low) * random.uniform(0, 1), low, high);
  }
}

template <class Interval>
std::string text(Interval a) {
  char line[100];
  std::snprintf(line, sizeof line, "[%a, %a]%s", a.low, a.high, a.defined ? "" : " undefined");
  return line;
}

template <class Interval, class Make>
void enclose_all(const std::vector<Operation<Interval>>& operations, Make make, bool flushed) {
  const int intervals = 5000 * dense(), points = 40 + 3 * std::min(dense(), 20);
  for (const auto& operation : operations) {
    Random random(7);
    int failures = 0;
    for (int i = 0; i < intervals && failures < 3; i++) {
      Range ranges[4];
      Interval boxes[4];
      Interval result;
      for (Range& range : ranges) range = random_range(random);
      {
        const Flushing flushing(flushed);
        for (int k = 0; k < 4; k++) boxes[k] = make(ranges[k].low, ranges[k].high);
        result = operation.enclose(boxes[0], boxes[1], boxes[2], boxes[3]);
      }
      const auto say = [&] {
        std::string all = operation.name;
        for (int k = 0; k < operation.operands; k++) all += " " + text(boxes[k]);
        return all + " -> " + text(result);
      };
      const bool harmless = std::isfinite(result.low) && std::isfinite(result.high) && result.low <= result.high &&
                            result.low >= -HUGE_REAL && result.high <= HUGE_REAL;
      failures += !harmless;
      EXPECT_TRUE(harmless) << say();
      for (int j = 0; j < points; j++) {
        double x[4];
        for (int k = 0; k < operation.operands; k++) x[k] = random_inside(random, ranges[k]);
        const double exact = operation.exact(x[0], operation.operands > 1 ? x[1] : 0, operation.operands > 2 ? x[2] : 0,
                                             operation.operands > 2 ? x[3] : 0);
        bool good;
        if (std::isnan(exact)) {
          good = !result.defined;
        } else {
          good =
              (exact >= result.low || result.low <= -HUGE_REAL) && (exact <= result.high || result.high >= HUGE_REAL);
        }
        if (good) continue;
        failures++;
        ADD_FAILURE() << say() << " but " << exact << " at " << x[0]
                      << (operation.operands > 1 ? ", " + std::to_string(x[1]) : "") << (flushed ? ", flushed" : "");
        break;
      }
    }
  }
}

TEST(KernelIntervals, ContainEveryResult) {
  for (const bool flushed : {false, true}) {
    enclose_all(fused_intervals(), ::fused::interval_make, flushed);
    enclose_all(separate_intervals(), ::separate::interval_make, flushed);
  }
}

TEST(KernelIntervals, AreTight) {
  using namespace ::separate;
  const auto of = [](double low, double high) {
    return interval_make(static_cast<float>(low), static_cast<float>(high));
  };
  const auto expect = [](Interval a, double low, double high) {
    EXPECT_TRUE(a.defined);
    EXPECT_LE(std::fabs(a.low - low), 40 * kRounding * std::fabs(low) + 2 * kTiny)
        << text(a) << " for " << low << " .. " << high;
    EXPECT_LE(std::fabs(a.high - high), 40 * kRounding * std::fabs(high) + 2 * kTiny)
        << text(a) << " for " << low << " .. " << high;
  };
  expect(interval_square(of(-2, 1)), 0, 4);
  expect(interval_power_integer(of(-2, 1), 4), 0, 16);
  expect(interval_power_integer(of(-2, 1), 3), -8, 1);
  expect(interval_power_integer(of(2, 4), -2), 1.0 / 16, 0.25);
  expect(interval_multiply(of(-2, 3), of(-5, 4)), -15, 12);
  expect(interval_divide(of(-2, 3), of(2, 4)), -1, 1.5);
  expect(interval_divide(of(-2, 3), of(-4, -2)), -1.5, 1);
  expect(interval_sine(of(0, 3)), 0, 1);
  expect(interval_sine(of(2, 2.5)), std::sin(2.5), std::sin(2.0));
  expect(interval_cosine(of(3, 4)), -1, std::cos(4.0));
  expect(interval_tangent(of(-1, 1)), -std::tan(1.0), std::tan(1.0));
  expect(interval_power(of(0, 4), of(1.5, 1.5)), 0, 8);
  expect(interval_arctangent2(of(-1, 1), of(1, 2)), -std::atan(1.0), std::atan(1.0));
  expect(interval_arctangent2(of(1, 2), of(-1, 1)), std::atan(1.0), 3 * std::atan(1.0));
  expect(interval_square_root(interval_add(interval_square(of(0, 3)), interval_square(of(-4, 4)))), 0, 5);
  expect(interval_modulo(of(7.25, 7.5), of(2, 2)), 1.25, 1.5);
  expect(interval_modulo(of(7.25, 8.5), of(2, 2)), 0, 2);
  expect(interval_absolute(of(-3, 2)), 0, 3);
  expect(interval_choose(of(1, 2), of(2, 3), of(5, 6), of(9, 9)), 5, 6);
  EXPECT_FALSE(interval_divide(of(1, 2), of(-1, 1)).defined);
  EXPECT_FALSE(interval_tangent(of(1, 2)).defined);
  EXPECT_FALSE(interval_logarithm(of(0, 2)).defined);
  EXPECT_FALSE(interval_arcsine(of(0, 1.1)).defined);
}

// ---- Running errors.

// A float with its error, seen as the interval that it stands for.
template <class Rounded>
struct Spread {
  Rounded rounded;
  float low = -HUGE_REAL, high = HUGE_REAL;
  bool defined = false;

  explicit Spread(Rounded r) : rounded(r) {
    if (!(r.error < 1e30f)) return;
    // One step outward, for the rounding of these very sums.
    low = std::nextafter(static_cast<float>(double{r.value} - r.error), -HUGE_REAL);
    high = std::nextafter(static_cast<float>(double{r.value} + r.error), HUGE_REAL);
    defined = true;
  }
  Spread() = default;
};

template <class Rounded>
Rounded plain(Spread<Rounded> a) {
  return a.rounded;
}
template <class Number>
Number plain(Number a) {
  return a;
}
// An operation on Rounded, on what they spread over.
template <class Apply>
auto spread(Apply apply) {
  return [apply](auto... a) { return Spread(apply(plain(a)...)); };
}

#define PREFIX(name) spread([](auto... x) { return ::errors_fused::rounded_##name(x...); })
std::vector<Operation<Spread<::errors_fused::Rounded>>> fused_rounded() {
  using I = Spread<::errors_fused::Rounded>;
  return {OPERATIONS};
}
#undef PREFIX
#define PREFIX(name) spread([](auto... x) { return ::errors_separate::rounded_##name(x...); })
std::vector<Operation<Spread<::errors_separate::Rounded>>> separate_rounded() {
  using I = Spread<::errors_separate::Rounded>;
  return {OPERATIONS};
}
#undef PREFIX

// The float in the middle, with an error that reaches both ends.
template <class Rounded, class Make>
auto spread_over(Make make) {
  return [make](float low, float high) {
    const float middle = static_cast<float>(0.5 * low + 0.5 * high);
    const double reach = std::max(double{high} - middle, double{middle} - low);
    // One step more, for what double has rounded off. Denormals may be flushed before they come here.
    const auto denormal = [](float x) {
      const std::uint32_t size = std::bit_cast<std::uint32_t>(x) & 0x7fffffffu;
      return size != 0 && size < 0x00800000u;
    };
    float error = reach > 0 ? std::max(std::nextafter(static_cast<float>(reach), HUGE_REAL), 2 * NORMAL_REAL) : 0.0f;
    if (denormal(low) || denormal(high)) error += 2 * NORMAL_REAL;
    return Spread<Rounded>(make(middle, error));
  };
}

TEST(KernelRounded, ErrorsReachEveryResult) {
  for (const bool flushed : {false, true}) {
    enclose_all(fused_rounded(), spread_over<::errors_fused::Rounded>(::errors_fused::rounded_make), flushed);
    enclose_all(separate_rounded(), spread_over<::errors_separate::Rounded>(::errors_separate::rounded_make), flushed);
  }
}

TEST(KernelRounded, AreTight) {
  using namespace ::errors_separate;
  const Rounded x = rounded_make(0.75f, 1e-6f), y = rounded_make(-3.0f, 2e-6f);
  const auto expect = [](Rounded a, double value, double error) {
    EXPECT_NEAR(a.value, value, 40 * kRounding * std::fabs(value));
    EXPECT_LE(a.error, 1.1 * error + 40 * kRounding * std::fabs(value)) << value;
    EXPECT_GE(a.error, error * 0.99) << value;
  };
  expect(rounded_add(x, y), -2.25, 3e-6);
  expect(rounded_multiply(x, y), -2.25, 4.5e-6);
  expect(rounded_divide(y, x), -4, 8e-6);
  expect(rounded_square_root(x), std::sqrt(0.75), 0.5e-6 / std::sqrt(0.75));
  expect(rounded_square(y), 9, 1.2e-5);
  expect(rounded_power_integer(y, 3), -27, 5.4e-5);
  expect(rounded_exponential(y), std::exp(-3), 2e-6 * std::exp(-3));
  expect(rounded_logarithm(x), std::log(0.75), 1e-6 / 0.75);
  expect(rounded_maximum(x, y), 0.75, 1e-6);
  expect(rounded_choose(y, x, x, y), 0.75, 1e-6);
  // The part of a crease: both sides of an open choice, carried through sums, products and quotients.
  EXPECT_EQ(rounded_choose(y, x, x, y).crease, 0);
  const Rounded open = rounded_choose(x, x, rounded_exact(2), rounded_exact(-1));
  EXPECT_EQ(open.value, 2);
  EXPECT_EQ(open.crease, 3);
  EXPECT_GE(open.error, 3);
  EXPECT_EQ(rounded_add(open, x).crease, 3);
  EXPECT_EQ(rounded_multiply(open, rounded_exact(-0.5f)).crease, 1.5f);
  EXPECT_EQ(rounded_multiply(open, rounded_exact(0)).crease, 0);
  EXPECT_EQ(rounded_divide(open, rounded_exact(-0.5f)).crease, 6);
  EXPECT_EQ(rounded_choose(y, x, x, open).crease, 0) << "not taken";
  EXPECT_FALSE(rounded_known(rounded_square_root(rounded_make(1e-7f, 1e-6f))));
  EXPECT_FALSE(rounded_known(rounded_divide(x, rounded_make(1e-7f, 1e-6f))));
  EXPECT_FALSE(rounded_known(rounded_multiply(rounded_exact(0), rounded_logarithm(y)))) << "the logarithm is undefined";
}

// ---- Slopes.

#define PREFIX(name) ::separate::dual_##name
std::vector<Operation<::separate::Dual>> dual_operations() {
  using I = ::separate::Dual;
  return {OPERATIONS};
}
#undef PREFIX

// Rounded to 12 bits.
double few_bits(double x) {
  const double split = x * ((1ll << 41) + 1);
  return split - (split - x);
}

// Operands are straight lines along the ray, whose result is followed in long steps and in short ones.
TEST(KernelDuals, SlopesContainDifferenceQuotients) {
  using namespace ::separate;
  for (const bool flushed : {false, true}) {
    for (const auto& operation : dual_operations()) {
      Random random(11);
      int failures = 0, with_slope = 0;
      for (int i = 0; i < 5000 * dense() && failures < 3; i++) {
        const double extent = std::ldexp(1.0, random.below(26) - 20);
        double start[4], rise[4];
        Dual lines[4];
        Dual result;
        {
          for (int k = 0; k < 4; k++) {
            const bool ordinary = random.below(3) > 0;
            start[k] =
                ordinary ? random.uniform(-4, 4) : static_cast<double>(static_cast<float>(random.sized(-100, 100)));
            rise[k] = random.below(5) == 0 ? 0.0 : random.sized(ordinary ? -4 : -60, ordinary ? 3 : 60);
            if (random.below(8) == 0) start[k] = 0;
            start[k] = few_bits(start[k]);
            rise[k] = few_bits(rise[k]);
          }
          const Flushing flushing(flushed);
          for (int k = 0; k < 4; k++) {
            const double end = start[k] + rise[k] * extent;
            const float low = std::nextafter(static_cast<float>(std::min(start[k], end)), -HUGE_REAL);
            const float high = std::nextafter(static_cast<float>(std::max(start[k], end)), HUGE_REAL);
            lines[k] = dual_make(interval_make(low, high), interval_point(static_cast<float>(rise[k])));
          }
          result = operation.enclose(lines[0], lines[1], lines[2], lines[3]);
        }
        const auto value = [&](double t) {
          return operation.exact(start[0] + rise[0] * t, start[1] + rise[1] * t, start[2] + rise[2] * t,
                                 start[3] + rise[3] * t);
        };
        // The ends of a difference quotient must lie on the lines to the last bit: cancellation would bring out
        // their rounding.
        const auto exact_at = [&](int k, double t) {
          const double step = rise[k] * t, sum = start[k] + step;
          return sum - start[k] == step && sum - step == start[k];
        };
        with_slope += result.slope.defined;
        for (int j = 0; j < 40; j++) {
          const double from = extent * random.below(4097) / 4096, to = extent * random.below(4097) / 4096;
          bool on_line = true;
          for (int k = 0; k < operation.operands; k++) on_line = on_line && exact_at(k, from) && exact_at(k, to);
          const double f = value(from), g = value(to);
          if (!on_line || from == to || !result.slope.defined || std::isinf(f) || std::isinf(g)) continue;
          const bool undefined = std::isnan(f) || std::isnan(g);
          const double quotient = (g - f) / (to - from);
          const double tolerance = 4e-16 * (std::fabs(f) + std::fabs(g)) / std::fabs(to - from);
          const bool good = !undefined &&
                            (quotient >= result.slope.low - tolerance || result.slope.low <= -HUGE_REAL) &&
                            (quotient <= result.slope.high + tolerance || result.slope.high >= HUGE_REAL);
          if (good) continue;
          failures++;
          ADD_FAILURE() << operation.name << " of " << text(lines[0].value) << " rising " << rise[0] << ", "
                        << text(lines[1].value) << " rising " << rise[1] << ": slope " << text(result.slope) << " but "
                        << quotient << " +- " << tolerance << " between " << from << " and " << to
                        << (flushed ? ", flushed" : "");
          break;
        }
      }
      EXPECT_GT(with_slope, 500) << operation.name << " hardly ever had a slope";
    }
  }
}

TEST(KernelDuals, SayWhereTheyAreNotSmooth) {
  using namespace ::separate;
  const auto line = [](float low, float high) { return dual_make(interval_make(low, high), interval_point(2)); };
  EXPECT_TRUE(dual_absolute(line(1, 2)).smooth_here);
  const Dual crease = dual_absolute(line(-1, 2));
  EXPECT_FALSE(crease.smooth_here);
  EXPECT_TRUE(crease.slope.defined);
  EXPECT_EQ(crease.slope.low, -2);
  EXPECT_EQ(crease.slope.high, 2);
  EXPECT_FALSE(dual_minimum(line(1, 3), line(2, 4)).smooth_here);
  EXPECT_TRUE(dual_minimum(line(1, 3), line(3, 4)).smooth_here);
  EXPECT_TRUE(dual_floor(line(1.25f, 1.75f)).slope.defined);
  for (const Dual& jump :
       {dual_floor(line(0.5f, 1.5f)), dual_sign(line(-1, 1)), dual_modulo(line(0.5f, 1.5f), dual_constant(1)),
        dual_choose(line(0, 2), dual_constant(1), dual_constant(4), dual_constant(5))}) {
    EXPECT_FALSE(jump.smooth_here);
    EXPECT_FALSE(jump.slope.defined);
    EXPECT_TRUE(jump.value.defined);
  }
  EXPECT_FALSE(dual_square_root(line(0, 1)).slope.defined);
  EXPECT_TRUE(dual_square_root(line(0, 1)).value.defined);
}

// ---- Generated expressions.

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

}  // namespace
}  // namespace smurf
