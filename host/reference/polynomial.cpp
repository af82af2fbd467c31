#include "reference/polynomial.hpp"

#include <numbers>

namespace smurf {
namespace {

// Nodes, and the matrix that takes values at the nodes to coefficients (a discrete cosine transform).
struct Transform {
  int degree;
  std::array<double, 10> node{};
  std::array<std::array<double, 10>, 10> matrix{};

  explicit Transform(int n) : degree(n) {
    auto end = [n](int i) { return i == 0 || i == n ? 2.0 : 1.0; };
    for (int j = 0; j <= n; j++) {
      node[j] = 2 * j == n ? 0.0 : std::cos(std::numbers::pi * j / n);
      for (int k = 0; k <= n; k++) {
        matrix[k][j] = 2.0 / n * std::cos(std::numbers::pi * ((j * k) % (2 * n)) / n) / (end(j) * end(k));
      }
    }
  }
};

const Transform& transform(int degree) {
  static const Transform cubic(3), nonic(9);
  return degree == 3 ? cubic : nonic;
}

}  // namespace

double Chebyshev::node(int degree, int j) { return transform(degree).node[j]; }

Chebyshev Chebyshev::through(int degree, const double* values) {
  const Transform& t = transform(degree);
  Chebyshev p;
  p.degree_ = degree;
  for (int k = 0; k <= degree; k++) {
    double sum = 0;
    for (int j = 0; j <= degree; j++) sum += t.matrix[k][j] * values[j];
    p.coefficients_[k] = sum;
  }
  return p;
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

double Chebyshev::distance_from_zero() const {
  double others = 0;
  for (int k = 1; k <= degree_; k++) others += std::abs(coefficients_[k]);
  return std::abs(coefficients_[0]) - others;
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
