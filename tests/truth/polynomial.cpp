#include "truth/polynomial.hpp"

#include <algorithm>

namespace smurf::test {

long double Polynomial::operator()(long double x) const {
  long double value = 0;
  for (auto c = coefficients_.rbegin(); c != coefficients_.rend(); ++c) value = value * x + *c;
  return value;
}

Polynomial Polynomial::derivative() const {
  std::vector<long double> d;
  for (std::size_t i = 1; i < coefficients_.size(); i++) d.push_back(coefficients_[i] * (long double)i);
  return Polynomial(std::move(d));
}

std::vector<long double> Polynomial::roots(long double lower, long double upper) const {
  if (degree() < 1) return {};
  std::vector<long double> knots = derivative().roots(lower, upper);
  knots.insert(knots.begin(), lower);
  knots.push_back(upper);

  std::vector<long double> found;
  for (std::size_t i = 0; i + 1 < knots.size(); i++) {
    long double a = knots[i], b = knots[i + 1];
    const bool below = (*this)(a) < 0;
    if (below == ((*this)(b) < 0)) continue;
    while (true) {
      const long double middle = a + (b - a) / 2;
      if (middle <= a || middle >= b) break;
      (((*this)(middle) < 0) == below ? a : b) = middle;
    }
    found.push_back(a);
  }
  return found;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  std::vector<long double> c(std::max(a.coefficients_.size(), b.coefficients_.size()), 0);
  for (std::size_t i = 0; i < a.coefficients_.size(); i++) c[i] += a.coefficients_[i];
  for (std::size_t i = 0; i < b.coefficients_.size(); i++) c[i] += b.coefficients_[i];
  return Polynomial(std::move(c));
}

Polynomial operator*(long double s, const Polynomial& a) {
  std::vector<long double> c = a.coefficients_;
  for (long double& x : c) x *= s;
  return Polynomial(std::move(c));
}

Polynomial operator-(const Polynomial& a, const Polynomial& b) { return a + -1.0L * b; }

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  if (a.coefficients_.empty() || b.coefficients_.empty()) return {};
  std::vector<long double> c(a.coefficients_.size() + b.coefficients_.size() - 1, 0);
  for (std::size_t i = 0; i < a.coefficients_.size(); i++)
    for (std::size_t j = 0; j < b.coefficients_.size(); j++) c[i + j] += a.coefficients_[i] * b.coefficients_[j];
  return Polynomial(std::move(c));
}

Polynomial constant(long double c) { return Polynomial({c}); }
Polynomial linear(long double c0, long double c1) { return Polynomial({c0, c1}); }

}  // namespace smurf::test
