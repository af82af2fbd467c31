#include "reference/polynomial.hpp"

#include <cstdint>
#include <limits>
#include <numbers>

namespace smurf {

ChebyshevPoints::ChebyshevPoints(int degree)
    : degree_(degree), points_(std::size_t(degree) + 1), matrix_(points_.size() * points_.size()) {
  const auto end = [degree](int i) { return i == 0 || i == degree ? 2.0 : 1.0; };
  for (int j = 0; j <= degree; j++) {
    // The sine of the distance from the middle is symmetric to the last bit.
    points_[std::size_t(j)] = std::sin(0.5 * std::numbers::pi * (2 * j - degree) / degree);
    for (int k = 0; k <= degree; k++) {
      const int multiple = int((std::int64_t(k) * (degree - j)) % (2 * degree));
      matrix_[std::size_t(k * (degree + 1) + j)] =
          2.0 / degree * std::cos(std::numbers::pi * multiple / degree) / (end(j) * end(k));
    }
  }
}

void ChebyshevPoints::coefficients(const double* values, double* out) const {
  for (int k = 0; k <= degree_; k++) {
    double sum = 0;
    for (int j = 0; j <= degree_; j++) sum += matrix_[std::size_t(k * (degree_ + 1) + j)] * values[j];
    out[k] = sum;
  }
}

Chebyshev::Chebyshev(int degree, const double* coefficients) : degree_(degree) {
  std::copy_n(coefficients, degree + 1, coefficients_.begin());
}

Chebyshev Chebyshev::trimmed() const {
  Chebyshev p = *this;
  const double negligible = std::numeric_limits<double>::epsilon() * sum();
  while (p.degree_ > 0 && std::abs(p.coefficients_[std::size_t(p.degree_)]) <= negligible) p.degree_--;
  return p;
}

double Chebyshev::sum() const {
  double sum = 0;
  for (int k = 0; k <= degree_; k++) sum += std::abs(coefficients_[k]);
  return sum;
}

double Chebyshev::operator()(double s) const {
  double b1 = 0, b2 = 0;
  for (int k = degree_; k > 0; k--) {
    const double b = coefficients_[k] + 2 * s * b1 - b2;
    b2 = b1;
    b1 = b;
  }
  return coefficients_[0] + s * b1 - b2;
}

Chebyshev Chebyshev::derivative() const {
  Chebyshev d;
  d.degree_ = std::max(0, degree_ - 1);
  for (int k = degree_; k > 0; k--) {
    const double above = k + 1 < degree_ ? d.coefficients_[k + 1] : 0.0;
    d.coefficients_[k - 1] = above + 2 * k * coefficients_[k];
  }
  d.coefficients_[0] *= 0.5;
  return d;
}

Chebyshev::Points Chebyshev::sign_changes() const {
  Points changes;
  if (degree_ == 0 || distance_from_zero() > 0) return changes;
  const Points turning = derivative().sign_changes();
  double a = -1, fa = (*this)(a);
  for (int i = 0; i <= turning.count; i++) {
    const double b = i < turning.count ? turning.at[i] : 1.0;
    const double fb = (*this)(b);
    if ((fa < 0) != (fb < 0)) {
      const double root = bracketed_root(*this, a, b, fa, fb);
      if (root > -1 && root < 1 && changes.count < degree_) changes.at[changes.count++] = root;
    }
    a = b;
    fa = fb;
  }
  return changes;
}

}  // namespace smurf
