// Running errors of the kernels, run on the host lane by lane: the exact result of all arguments within their errors, in double, lies
// within the error of the result. Denormals are kept, and flushed where the processor can do that.
#include "harness/kernel_operations.hpp"

#define CHOICES 1
namespace errors_fused {
using namespace one_lane;
using one_lane::fused::multiply_add;
#include "kernels/arithmetic/running_error.inc"
}  // namespace errors_fused
namespace errors_separate {
using namespace one_lane;
using one_lane::separate::multiply_add;
#include "kernels/arithmetic/running_error.inc"
}  // namespace errors_separate

namespace smurf {
namespace {

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

}  // namespace
}  // namespace smurf
