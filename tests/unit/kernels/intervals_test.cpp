// Interval arithmetic of the kernels, run on the host lane by lane: enclosures against double at random points within
// them, slopes against difference quotients. Denormals are kept, and flushed where the processor can do that.
#include "unit/kernels/kernel_operations.hpp"

namespace smurf {
namespace {

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
    EXPECT_LE(std::fabs(a.low - low), 40 * rounding * std::fabs(low) + 2 * tiny)
        << text(a) << " for " << low << " .. " << high;
    EXPECT_LE(std::fabs(a.high - high), 40 * rounding * std::fabs(high) + 2 * tiny)
        << text(a) << " for " << low << " .. " << high;
  };
  expect(interval_square(of(-2, 1)), 0, 4);
  expect(interval_power_integer(of(-2, 1), 4), 0, 16);
  expect(interval_power_integer(of(-2, 1), 3), -8, 1);
  expect(interval_power_integer(of(2, 4), -2), 1.0 / 16, 0.25);
  expect(interval_multiply(of(-2, 3), of(-5, 4)), -15, 12);
  expect(interval_divide(of(-2, 3), of(2, 4)), -1, 1.5);
  expect(interval_divide(of(-2, 3), of(-4, -2)), -1.5, 1);
  expect(interval_sin(of(0, 3)), 0, 1);
  expect(interval_sin(of(2, 2.5)), std::sin(2.5), std::sin(2.0));
  expect(interval_cos(of(3, 4)), -1, std::cos(4.0));
  expect(interval_tan(of(-1, 1)), -std::tan(1.0), std::tan(1.0));
  expect(interval_pow(of(0, 4), of(1.5, 1.5)), 0, 8);
  expect(interval_atan2(of(-1, 1), of(1, 2)), -std::atan(1.0), std::atan(1.0));
  expect(interval_atan2(of(1, 2), of(-1, 1)), std::atan(1.0), 3 * std::atan(1.0));
  expect(interval_sqrt(interval_add(interval_square(of(0, 3)), interval_square(of(-4, 4)))), 0, 5);
  expect(interval_mod(of(7.25, 7.5), of(2, 2)), 1.25, 1.5);
  expect(interval_mod(of(7.25, 8.5), of(2, 2)), 0, 2);
  expect(interval_abs(of(-3, 2)), 0, 3);
  expect(interval_choose(of(1, 2), of(2, 3), of(5, 6), of(9, 9)), 5, 6);
  EXPECT_FALSE(interval_divide(of(1, 2), of(-1, 1)).defined);
  EXPECT_FALSE(interval_tan(of(1, 2)).defined);
  EXPECT_FALSE(interval_log(of(0, 2)).defined);
  EXPECT_FALSE(interval_asin(of(0, 1.1)).defined);
}

// ---- Slopes.

#define PREFIX(name) ::separate::interval_dual_##name
std::vector<Operation<::separate::IntervalDual>> interval_dual_operations() {
  using I = ::separate::IntervalDual;
  return {OPERATIONS};
}
#undef PREFIX

// Bounded to 12 bits.
double few_bits(double x) {
  const double split = x * ((1ll << 41) + 1);
  return split - (split - x);
}

// Operands are straight lines along the ray, whose result is followed in long steps and in short ones.
TEST(KernelDuals, SlopesContainDifferenceQuotients) {
  using namespace ::separate;
  for (const bool flushed : {false, true}) {
    for (const auto& operation : interval_dual_operations()) {
      Random random(11);
      int failures = 0, with_slope = 0;
      for (int i = 0; i < 5000 * density() && failures < 3; i++) {
        const double extent = std::ldexp(1.0, random.below(26) - 20);
        double start[4], rise[4];
        IntervalDual lines[4];
        IntervalDual result;
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
            lines[k] = interval_dual_make(interval_make(low, high), interval_point(static_cast<float>(rise[k])));
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
  const auto line = [](float low, float high) {
    return interval_dual_make(interval_make(low, high), interval_point(2));
  };
  EXPECT_TRUE(interval_dual_abs(line(1, 2)).smooth_here);
  const IntervalDual crease = interval_dual_abs(line(-1, 2));
  EXPECT_FALSE(crease.smooth_here);
  EXPECT_TRUE(crease.slope.defined);
  EXPECT_EQ(crease.slope.low, -2);
  EXPECT_EQ(crease.slope.high, 2);
  EXPECT_FALSE(interval_dual_min(line(1, 3), line(2, 4)).smooth_here);
  EXPECT_TRUE(interval_dual_min(line(1, 3), line(3, 4)).smooth_here);
  EXPECT_TRUE(interval_dual_floor(line(1.25f, 1.75f)).slope.defined);
  for (const IntervalDual& jump : {interval_dual_floor(line(0.5f, 1.5f)), interval_dual_sign(line(-1, 1)),
                                   interval_dual_mod(line(0.5f, 1.5f), interval_dual_constant(1)),
                                   interval_dual_choose(line(0, 2), interval_dual_constant(1),
                                                        interval_dual_constant(4), interval_dual_constant(5))}) {
    EXPECT_FALSE(jump.smooth_here);
    EXPECT_FALSE(jump.slope.defined);
    EXPECT_TRUE(jump.value.defined);
  }
  EXPECT_FALSE(interval_dual_sqrt(line(0, 1)).slope.defined);
  EXPECT_TRUE(interval_dual_sqrt(line(0, 1)).value.defined);
}

}  // namespace
}  // namespace smurf
