// Polynomials of one variable on [-1, 1] as Chebyshev series, and all of their roots.
//
// A series is made from samples at the Chebyshev-Lobatto points, which is exact for polynomials and
// well conditioned. Its sign changes are found by the ladder of derivatives: between neighbouring
// sign changes of its derivative a polynomial is monotone, hence has at most one root there, which
// bisection-safe iteration finds. Nothing is sampled and hoped for.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace smurf {

// The Chebyshev-Lobatto points of a degree, ascending, and what takes values there to coefficients (a discrete cosine
// transform).
class ChebyshevPoints {
 public:
  explicit ChebyshevPoints(int degree);
  int degree() const { return degree_; }
  double operator[](int j) const { return points_[std::size_t(j)]; }
  // degree + 1 values in, as many coefficients out.
  void coefficients(const double* values, double* out) const;
  std::size_t bytes() const { return (points_.size() + matrix_.size()) * sizeof(double); }

 private:
  int degree_;
  std::vector<double> points_, matrix_;
};

class Chebyshev {
 public:
  static constexpr int max_degree = 16;  // beyond it, the rounding of high derivatives shows

  Chebyshev() = default;
  Chebyshev(int degree, const double* coefficients);
  // Without the last coefficients where they are below rounding.
  Chebyshev trimmed() const;

  double operator()(double s) const;
  Chebyshev derivative() const;
  double sum() const;  // of the coefficients' sizes: |p| is at most this on [-1, 1]
  // |p| is at least this on [-1, 1]; negative when nothing is known.
  double distance_from_zero() const { return 2 * std::abs(coefficients_[0]) - sum(); }
  double constant() const { return coefficients_[0]; }

  struct Points {
    std::array<double, max_degree> at;
    int count = 0;
  };
  // All points of (-1, 1) where the sign changes, ascending.
  Points sign_changes() const;

 private:
  std::array<double, max_degree + 1> coefficients_{};
  int degree_ = 0;
};

// A zero of f between a and b, to the last bits; fa = f(a) and fb = f(b) must not have the same strict sign.
// Brent's method (Algorithms for Minimization Without Derivatives, 1973, chapter 4).
template <class Function>
double bracketed_root(const Function& f, double a, double b, double fa, double fb) {
  constexpr double epsilon = 2.220446049250313e-16;
  if (fa == 0) return a;
  double c = a, fc = fa, step = b - a, last_step = step;
  for (int iteration = 0; iteration < 200 && fb != 0; iteration++) {
    if ((fb > 0) == (fc > 0)) {
      c = a;
      fc = fa;
      last_step = step = b - a;
    }
    if (std::abs(fc) < std::abs(fb)) {
      a = b, b = c, c = a;
      fa = fb, fb = fc, fc = fa;
    }
    const double tolerance = 2 * epsilon * std::abs(b) + 1e-17;
    const double half = 0.5 * (c - b);
    if (std::abs(half) <= tolerance) break;
    bool bisect = true;
    if (std::abs(last_step) >= tolerance && std::abs(fa) > std::abs(fb)) {
      const double s = fb / fa;
      double p, q;
      if (a == c) {  // secant
        p = 2 * half * s;
        q = 1 - s;
      } else {  // inverse quadratic
        const double r = fa / fc, v = fb / fc;
        p = s * (2 * half * r * (r - v) - (b - a) * (v - 1));
        q = (r - 1) * (v - 1) * (s - 1);
      }
      if (p > 0) q = -q;
      p = std::abs(p);
      if (2 * p < std::min(3 * half * q - std::abs(tolerance * q), std::abs(last_step * q))) {
        last_step = step;
        step = p / q;
        bisect = false;
      }
    }
    if (bisect) last_step = step = half;
    a = b;
    fa = fb;
    b += std::abs(step) > tolerance ? step : std::copysign(tolerance, half);
    fb = f(b);
  }
  return b;
}

}  // namespace smurf
