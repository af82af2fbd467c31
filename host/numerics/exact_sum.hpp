// Sums of doubles without rounding, for the signs of determinants (Shewchuk 1997, "Adaptive precision floating-point
// arithmetic").
//
// The sum is kept as an expansion: doubles that do not overlap, least first.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace smurf {

// Of at most `Most` summands.
template <std::size_t Most>
class ExactSum {
 public:
  // Grow-Expansion: a pass from the least part upwards, each time with the rounding error of one addition left behind
  // (Knuth).
  void add(double x) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; i++) {
      const double sum = x + parts_[i], virtual_part = sum - x;
      const double error = (x - (sum - virtual_part)) + (parts_[i] - virtual_part);
      if (error != 0) parts_[kept++] = error;
      x = sum;
    }
    if (x != 0) {
      assert(kept < Most);
      parts_[kept++] = x;
    }
    count_ = kept;
  }
  // a·b and a·b·c, in two and four summands; of floats in one and two. No part may underflow: products of floats do
  // not.
  void add_product(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }
  void add_product(double a, double b, double c) {
    const double product = a * b;
    add_product(std::fma(a, b, -product), c);
    add_product(product, c);
  }

  // The greatest part decides: it outweighs all others together.
  int sign() const { return count_ == 0 ? 0 : (parts_[count_ - 1] > 0 ? 1 : -1); }
  // To the last place or the one before.
  double value() const {
    double sum = 0;
    for (std::size_t i = 0; i < count_; i++) sum += parts_[i];
    return sum;
  }

 private:
  std::array<double, Most> parts_;
  std::size_t count_ = 0;
};

}  // namespace smurf
