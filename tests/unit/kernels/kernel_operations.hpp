// What the tests of device code of expressions share: the code itself, one lane, with multiply_add fused and not; every
// operation beside its exact answer; random ranges of all sizes.
//
// SMURF_TEST_DENSE=20 makes the samples that many times denser.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "harness/density.hpp"
#include "unit/kernels/one_lane.hpp"

namespace fused {
using namespace one_lane;
using one_lane::fused::multiply_add;
#include "kernels/arithmetic/interval_dual.inc"
}  // namespace fused
namespace separate {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/interval_dual.inc"
}  // namespace separate

namespace smurf {

using test::density;

inline constexpr double rounding = 0x1p-24;
inline constexpr double tiny = TINY_REAL;
inline constexpr double most = std::numeric_limits<float>::max();
inline constexpr double huge = HUGE_REAL;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double undefined = std::numeric_limits<double>::quiet_NaN();

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

// ---- Operations and their exact answers.

template <class Interval>
struct Operation {
  const char* name;
  std::function<Interval(Interval, Interval, Interval, Interval)> enclose;
  std::function<double(double, double, double, double)> exact;  // not a number where undefined
  int operands;
};

inline double defined_if(bool defined, double value) { return defined ? value : undefined; }
// a - b * floor(a / b), exact where double can hold it.
inline double modulo(double a, double b) {
  const double rest = std::fmod(a, b);
  return defined_if(b != 0, rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest);
}
inline double sign(double x) { return x > 0 ? 1.0 : (x < 0 ? -1.0 : 0.0); }
inline double whole_power(double a, int n) { return defined_if(n >= 0 || a != 0, std::pow(a, n)); }
inline double power(double a, double b) { return defined_if(a > 0 || (a == 0 && b > 0), std::pow(a, b)); }

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
      ONE(abs, std::fabs(a)), ONE(square, a* a), WITH(power_integer, 0, 1 + 0 * a), WITH(power_integer, 1, a),         \
      WITH(power_integer, 2, a* a), WITH(power_integer, 3, whole_power(a, 3)),                                         \
      WITH(power_integer, 4, whole_power(a, 4)), WITH(power_integer, 7, whole_power(a, 7)),                            \
      WITH(power_integer, -1, whole_power(a, -1)), WITH(power_integer, -2, whole_power(a, -2)),                        \
      WITH(power_integer, -5, whole_power(a, -5)), TWO(pow, power(a, b)), ONE(sqrt, defined_if(a >= 0, std::sqrt(a))), \
      ONE(exp, std::exp(a)), ONE(log, defined_if(a > 0, std::log(a))), ONE(sin, std::sin(a)), ONE(cos, std::cos(a)),   \
      ONE(tan, std::tan(a)), ONE(asin, std::asin(a)), ONE(acos, std::acos(a)), ONE(atan, std::atan(a)),                \
      TWO(atan2, defined_if(a != 0 || b != 0, std::atan2(a + 0.0, b))), ONE(sinh, std::sinh(a)),                       \
      ONE(cosh, std::cosh(a)), ONE(tanh, std::tanh(a)), TWO(min, std::min(a, b)), TWO(max, std::max(a, b)),            \
      ONE(floor, std::floor(a)), ONE(sign, sign(a)), TWO(mod, modulo(a, b)),                                           \
      WITH(add_constant, -0.3f, a + double{-0.3f}), WITH(multiply_constant, -0.3f, a* double{-0.3f}),                  \
      WITH(multiply_constant, 1e20f, a* double{1e20f}), WITH(multiply_constant, 1e-42f, a* double{1e-42f}), {          \
    "choose", [](I a, I b, I c, I d) { return PREFIX(choose)(a, b, c, d); },                                           \
        [](double a, double b, double c, double d) { return a <= b ? c : d; }, 4                                       \
  }

// ---- Ranges.

struct Range {
  float low, high;
};

inline Range ordered(double a, double b) {
  const float low = static_cast<float>(std::clamp(std::min(a, b), -most, most));
  const float high = static_cast<float>(std::clamp(std::max(a, b), -most, most));
  return {low, high};
}

// Of all sizes and widths: points, narrow and wide ones, across and at zero, denormal, next to overflow, unbounded.
inline Range random_range(Random& random) {
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
inline double random_inside(Random& random, Range range) {
  const double low = range.low <= -huge ? -std::exp2(random.uniform(128, 1000)) : range.low;
  const double high = range.high >= huge ? std::exp2(random.uniform(128, 1000)) : range.high;
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
inline std::string text(Interval a) {
  char line[100];
  std::snprintf(line, sizeof line, "[%a, %a]%s", a.low, a.high, a.defined ? "" : " undefined");
  return line;
}

template <class Interval, class Make>
void enclose_all(const std::vector<Operation<Interval>>& operations, Make make, bool flushed) {
  const int intervals = 5000 * density(), points = 40 + 3 * std::min(density(), 20);
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

}  // namespace smurf
