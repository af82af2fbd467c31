// Running errors of the kernels, run on the host lane by lane: the exact result of all arguments within their errors,
// in double, lies within the error of the result. Denormals are kept, and flushed where the processor can do that.
#include "unit/kernels/kernel_operations.hpp"

#define CHOICES 1
namespace errors_fused {
using namespace one_lane;
using one_lane::fused::multiply_add;
#include "kernels/arithmetic/bounded.inc"
}  // namespace errors_fused
namespace errors_separate {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/bounded.inc"
}  // namespace errors_separate

namespace smurf {
namespace {

// A float with its error, seen as the interval that it stands for.
template <class Bounded>
struct Spread {
  Bounded rounded;
  float low = -HUGE_REAL, high = HUGE_REAL;
  bool defined = false;

  explicit Spread(Bounded r) : rounded(r) {
    if (!(r.error < 1e30f)) return;
    // One step outward, for the rounding of these very sums.
    low = std::nextafter(static_cast<float>(double{r.value} - r.error), -HUGE_REAL);
    high = std::nextafter(static_cast<float>(double{r.value} + r.error), HUGE_REAL);
    defined = true;
  }
  Spread() = default;
};

template <class Bounded>
Bounded plain(Spread<Bounded> a) {
  return a.rounded;
}
template <class Number>
Number plain(Number a) {
  return a;
}
// An operation on Bounded, on what they spread over.
template <class Apply>
auto spread(Apply apply) {
  return [apply](auto... a) { return Spread(apply(plain(a)...)); };
}

#define PREFIX(name) spread([](auto... x) { return ::errors_fused::bounded_##name(x...); })
std::vector<Operation<Spread<::errors_fused::Bounded>>> fused_rounded() {
  using I = Spread<::errors_fused::Bounded>;
  return {OPERATIONS};
}
#undef PREFIX
#define PREFIX(name) spread([](auto... x) { return ::errors_separate::bounded_##name(x...); })
std::vector<Operation<Spread<::errors_separate::Bounded>>> separate_rounded() {
  using I = Spread<::errors_separate::Bounded>;
  return {OPERATIONS};
}
#undef PREFIX

// The float in the middle, with an error that reaches both ends.
template <class Bounded, class Make>
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
    return Spread<Bounded>(make(middle, error));
  };
}

TEST(KernelRounded, ErrorsReachEveryResult) {
  for (const bool flushed : {false, true}) {
    enclose_all(fused_rounded(), spread_over<::errors_fused::Bounded>(::errors_fused::bounded_make), flushed);
    enclose_all(separate_rounded(), spread_over<::errors_separate::Bounded>(::errors_separate::bounded_make), flushed);
  }
}

TEST(KernelRounded, AreTight) {
  using namespace ::errors_separate;
  const Bounded x = bounded_make(0.75f, 1e-6f), y = bounded_make(-3.0f, 2e-6f);
  const auto expect = [](Bounded a, double value, double error) {
    EXPECT_NEAR(a.value, value, 40 * rounding * std::fabs(value));
    EXPECT_LE(a.error, 1.1 * error + 40 * rounding * std::fabs(value)) << value;
    EXPECT_GE(a.error, error * 0.99) << value;
  };
  expect(bounded_add(x, y), -2.25, 3e-6);
  expect(bounded_multiply(x, y), -2.25, 4.5e-6);
  expect(bounded_divide(y, x), -4, 8e-6);
  expect(bounded_sqrt(x), std::sqrt(0.75), 0.5e-6 / std::sqrt(0.75));
  expect(bounded_square(y), 9, 1.2e-5);
  expect(bounded_power_integer(y, 3), -27, 5.4e-5);
  expect(bounded_exp(y), std::exp(-3), 2e-6 * std::exp(-3));
  expect(bounded_log(x), std::log(0.75), 1e-6 / 0.75);
  expect(bounded_max(x, y), 0.75, 1e-6);
  expect(bounded_choose(y, x, x, y), 0.75, 1e-6);
  // The part of a crease: both sides of an open choice, carried through sums, products and quotients.
  EXPECT_EQ(bounded_choose(y, x, x, y).crease, 0);
  const Bounded open = bounded_choose(x, x, bounded_exact(2), bounded_exact(-1));
  EXPECT_EQ(open.value, 2);
  EXPECT_EQ(open.crease, 3);
  EXPECT_GE(open.error, 3);
  EXPECT_EQ(bounded_add(open, x).crease, 3);
  EXPECT_EQ(bounded_multiply(open, bounded_exact(-0.5f)).crease, 1.5f);
  EXPECT_EQ(bounded_multiply(open, bounded_exact(0)).crease, 0);
  EXPECT_EQ(bounded_divide(open, bounded_exact(-0.5f)).crease, 6);
  EXPECT_EQ(bounded_choose(y, x, x, open).crease, 0) << "not taken";
  EXPECT_FALSE(bounded_known(bounded_sqrt(bounded_make(1e-7f, 1e-6f))));
  EXPECT_FALSE(bounded_known(bounded_divide(x, bounded_make(1e-7f, 1e-6f))));
  EXPECT_FALSE(bounded_known(bounded_multiply(bounded_exact(0), bounded_log(y)))) << "the logarithm is undefined";
}

}  // namespace
}  // namespace smurf
