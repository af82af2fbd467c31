// A function restricted to the part of a ray that lies in its domain, in double precision: values, slopes, and what
// rounding leaves of them. Rays are seen from where they enter, so that far origins and long directions lose nothing.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "expression/evaluate.hpp"
#include "expression/interval.hpp"
#include "reference/polynomial.hpp"
#include "reference/surface.hpp"
#include "surfaces/implicit/definition.hpp"

namespace smurf {

constexpr int greatest_whole_degree = 60;  // of polynomials that are taken up as such

// All that does not depend on the level and the domain.
struct CompiledFunction {
  std::shared_ptr<const ImplicitFunction> function;
  expression::Evaluator value, gradient;
  expression::IntervalEvaluator bounds;
  bool polynomial;
  ChebyshevPoints points;  // at which pieces of rays are sampled
  std::size_t bytes;

  explicit CompiledFunction(std::shared_ptr<const ImplicitFunction> f);
};

// The range of t that the domain leaves of a ray; nothing when it misses the domain.
std::optional<std::pair<double, double>> clipped_range(const Domain& domain, const ReferenceRay& ray);

// f - level along the part of a ray that is in the domain: u from 0 to 1.
class FunctionOnRay {
 public:
  // Nothing when the ray misses the domain.
  static std::optional<FunctionOnRay> clipped(const CompiledFunction& function, const Domain& domain, double level,
                                              const ReferenceRay& ray);

  const CompiledFunction& compiled() const { return compiled_; }
  double t(double u) const { return t_entry_ + u * length_; }
  double length() const { return length_; }  // of the span, in t

  double operator()(double u) const;  // NaN where the function is undefined or infinite
  double slope(double u) const;       // df/dt; NaN where it has none
  // Of f - level in the box around [a, b] of the ray.
  expression::Interval bounds(double a, double b) const;
  // What f is known up to for the rounding of the point and of its terms; NaN where it has no bounds.
  double noise(double u) const;

 private:
  FunctionOnRay(const CompiledFunction& compiled, double level) : compiled_(compiled), level_(level) {}
  glm::dvec3 point(double u) const;

  const CompiledFunction& compiled_;
  double level_;
  double t_entry_ = 0, length_ = 0;
  glm::dvec3 entry_{0.0}, along_{0.0}, error_{0.0};
  mutable std::vector<double> scratch_;
  mutable std::vector<expression::Interval> interval_scratch_;
};

// Whether the point is in the domain, or outside by no more than 1e-9 of its extent or by the rounding of a point that
// was stored as float.
bool is_within(const Domain& domain, const glm::dvec3& point);

}  // namespace smurf
