// Polynomials in one variable, in long double: the exact answer along a ray for fields that are polynomial.
#pragma once

#include <vector>

namespace smurf::test {

class Polynomial {
 public:
  Polynomial() = default;
  explicit Polynomial(std::vector<long double> coefficients) : coefficients_(std::move(coefficients)) {}

  int degree() const { return int(coefficients_.size()) - 1; }
  long double operator()(long double x) const;
  Polynomial derivative() const;

  // Where the polynomial changes sign in [lower, upper], ascending. Between two neighbouring roots of the derivative
  // it is monotone, so that the signs there decide; roots of even order (no change of sign) are not among them.
  std::vector<long double> roots(long double lower, long double upper) const;

  friend Polynomial operator+(const Polynomial& a, const Polynomial& b);
  friend Polynomial operator-(const Polynomial& a, const Polynomial& b);
  friend Polynomial operator*(const Polynomial& a, const Polynomial& b);
  friend Polynomial operator*(long double s, const Polynomial& a);

 private:
  std::vector<long double> coefficients_;  // of 1, x, x², …
};

Polynomial constant(long double c);
Polynomial linear(long double c0, long double c1);

}  // namespace smurf::test
