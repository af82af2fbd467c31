// The words of kernels/prelude.cl for one lane in C++, so that device code of kernels/core runs in tests without a
// device.
//
// Include this after all other headers, because the words are partly macros. Then, in a namespace of one's own,
//   using namespace one_lane;
//   using one_lane::fused::multiply_add;  // or one_lane::separate::multiply_add
//   #include "kernels/common/functions.inc"
// Files of kernels/core have no guards and include each other: at most one of them per namespace.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#define FN [[maybe_unused]] static inline
#define FN_SHARED [[maybe_unused]] static
#define STRUCT(name) struct name
#define UNROLL

namespace one_lane {

using real = float;
using integer = int;
using mask = bool;
using word = std::uint32_t;

inline real to_real(integer i) { return static_cast<real>(i); }
inline integer to_integer(real r) { return static_cast<integer>(r); }
inline word to_word(integer i) { return static_cast<word>(i); }
inline integer to_signed(word w) { return static_cast<integer>(w); }
inline real as_real(word w) { return std::bit_cast<real>(w); }
inline word as_word(real r) { return std::bit_cast<word>(r); }
inline bool any_lane(mask m) { return m; }
inline mask mask_all() { return true; }
inline mask mask_none() { return false; }
inline real splat(double x) { return static_cast<real>(x); }
inline integer splat_integer(int x) { return x; }
inline word splat_word(word x) { return x; }
inline real abs_real(real x) { return std::fabs(x); }
inline real sqrt_real(real x) { return std::sqrt(x); }
// The errors of a rounded product and a rounded sum, exact.
inline real product_error(real a, real b, real p) { return std::fma(a, b, -p); }
inline real sum_error(real a, real b, real s) {
  const real v = s - a;
  return (a - (s - v)) + (b - v);
}

// Devices differ in this one.
namespace fused {
inline real multiply_add(real a, real b, real c) { return std::fma(a, b, c); }
}  // namespace fused
namespace separate {
inline real multiply_add(real a, real b, real c) { return a * b + c; }
}  // namespace separate

}  // namespace one_lane
