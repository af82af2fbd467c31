// Functions of u and v with their first and second derivatives, by the rules of calculus: what test surfaces are
// written in, so that their derivatives come from no text of the library's.
#pragma once

#include <cmath>

namespace smurf::test {

struct Jet2 {
  double value = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0;

  Jet2() = default;
  Jet2(double constant) : value(constant) {}  // NOLINT: numbers are jets
  Jet2(double at, double by_u, double by_v) : value(at), u(by_u), v(by_v) {}
};

// f(a), given f and its derivatives at a's value.
inline Jet2 chained(const Jet2& a, double f, double first, double second) {
  Jet2 r;
  r.value = f;
  r.u = first * a.u;
  r.v = first * a.v;
  r.uu = first * a.uu + second * a.u * a.u;
  r.uv = first * a.uv + second * a.u * a.v;
  r.vv = first * a.vv + second * a.v * a.v;
  return r;
}

inline Jet2 operator+(const Jet2& a, const Jet2& b) {
  Jet2 r;
  r.value = a.value + b.value;
  r.u = a.u + b.u, r.v = a.v + b.v;
  r.uu = a.uu + b.uu, r.uv = a.uv + b.uv, r.vv = a.vv + b.vv;
  return r;
}
inline Jet2 operator*(const Jet2& a, const Jet2& b) {
  Jet2 r;
  r.value = a.value * b.value;
  r.u = a.u * b.value + a.value * b.u;
  r.v = a.v * b.value + a.value * b.v;
  r.uu = a.uu * b.value + 2 * a.u * b.u + a.value * b.uu;
  r.uv = a.uv * b.value + a.u * b.v + a.v * b.u + a.value * b.uv;
  r.vv = a.vv * b.value + 2 * a.v * b.v + a.value * b.vv;
  return r;
}
inline Jet2 operator-(const Jet2& a) { return a * Jet2(-1); }
inline Jet2 operator-(const Jet2& a, const Jet2& b) { return a + -b; }
inline Jet2 inverse(const Jet2& a) {
  const double r = 1 / a.value;
  return chained(a, r, -r * r, 2 * r * r * r);
}
inline Jet2 operator/(const Jet2& a, const Jet2& b) { return a * inverse(b); }
inline Jet2 sin(const Jet2& a) { return chained(a, std::sin(a.value), std::cos(a.value), -std::sin(a.value)); }
inline Jet2 cos(const Jet2& a) { return chained(a, std::cos(a.value), -std::sin(a.value), -std::cos(a.value)); }
inline Jet2 cosh(const Jet2& a) { return chained(a, std::cosh(a.value), std::sinh(a.value), std::cosh(a.value)); }
inline Jet2 tanh(const Jet2& a) {
  const double t = std::tanh(a.value), slope = 1 - t * t;
  return chained(a, t, slope, -2 * t * slope);
}

}  // namespace smurf::test
