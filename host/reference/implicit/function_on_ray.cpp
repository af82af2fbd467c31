#include "reference/implicit/function_on_ray.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace smurf {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double domain_slack = 1e-9;  // as of grids: rays in the domain's faces are not left to rounding

glm::dvec3 at(const ReferenceRay& ray, double t) {
  glm::dvec3 x;
  for (int a = 0; a < 3; a++) x[a] = std::fma(ray.direction[a], t, ray.origin[a]);
  return x;
}

// The ball about the coordinates' origin, seen from the middle of [from, to], so that it is near.
bool clip_to_ball(double radius, const ReferenceRay& ray, double& from, double& to) {
  const double speed = glm::length(ray.direction), middle = 0.5 * (from + to);
  const glm::dvec3 unit = ray.direction / speed, centre = at(ray, middle);
  const double nearest = -glm::dot(centre, unit);
  const glm::dvec3 foot = centre + nearest * unit;
  const double distance = glm::length(foot);
  if (!(distance <= radius)) return false;
  const double half = std::sqrt((radius - distance) * (radius + distance));
  from = std::max(from, middle + (nearest - half) / speed);
  to = std::min(to, middle + (nearest + half) / speed);
  return from <= to;
}

}  // namespace

CompiledFunction::CompiledFunction(std::shared_ptr<const ImplicitFunction> f)
    : function(std::move(f)),
      value(function->graph, std::span(&function->value, 1)),
      gradient(function->graph, function->gradient),
      bounds(function->graph, std::span(&function->value, 1)),
      polynomial(function->degree >= 0 && function->degree <= greatest_whole_degree),
      points(polynomial ? std::max(1, function->degree) : Chebyshev::max_degree) {
  const std::size_t values = expression::reachable(function->graph, std::span(&function->value, 1)).size();
  const std::size_t slopes = expression::reachable(function->graph, function->gradient).size();
  bytes = (function->graph.size() + 2 * values + slopes) * sizeof(expression::Node) + points.bytes();
}

std::optional<std::pair<double, double>> clipped_range(const Domain& domain, const ReferenceRay& ray) {
  double from = ray.t_min, to = ray.t_max;
  for (int a = 0; a < 3; a++) {
    const double slack = domain_slack * (domain.upper[a] - domain.lower[a]);
    const double low = domain.lower[a] - slack, high = domain.upper[a] + slack;
    if (ray.direction[a] == 0) {
      if (!(ray.origin[a] >= low && ray.origin[a] <= high)) return {};
      continue;
    }
    const double at_low = (low - ray.origin[a]) / ray.direction[a], at_high = (high - ray.origin[a]) / ray.direction[a];
    from = std::max(from, std::min(at_low, at_high));
    to = std::min(to, std::max(at_low, at_high));
  }
  if (!(from <= to) || !std::isfinite(from) || !std::isfinite(to)) return {};
  if (domain.radius > 0 && !clip_to_ball(domain.radius * (1 + domain_slack), ray, from, to)) return {};
  return std::pair(from, to);
}

std::optional<FunctionOnRay> FunctionOnRay::clipped(const CompiledFunction& function, const Domain& domain,
                                                    double level, const ReferenceRay& ray) {
  const auto range = clipped_range(domain, ray);
  if (!range) return {};
  const auto [from, to] = *range;
  FunctionOnRay line(function, level);
  line.t_entry_ = from;
  line.length_ = to - from;
  line.entry_ = at(ray, from);
  line.along_ = line.length_ * ray.direction;
  line.error_ = epsilon * (glm::abs(line.entry_) + glm::abs(line.along_));
  return line;
}

double FunctionOnRay::operator()(double u) const {
  const glm::dvec3 x = point(u);
  double value = 0;
  compiled_.value(std::span(&x.x, 3), std::span(&value, 1), scratch_);
  return std::isfinite(value) ? value - level_ : nan;
}

double FunctionOnRay::slope(double u) const {
  const glm::dvec3 x = point(u);
  glm::dvec3 gradient(0.0);
  compiled_.gradient(std::span(&x.x, 3), std::span(&gradient.x, 3), scratch_);
  const double slope = length_ > 0 ? glm::dot(gradient, along_) / length_ : 0;
  return std::isfinite(slope) ? slope : nan;
}

expression::Interval FunctionOnRay::bounds(double a, double b) const {
  const glm::dvec3 x = point(a), y = point(b);
  std::array<expression::Interval, 3> box;
  for (int i = 0; i < 3; i++) box[i] = {std::min(x[i], y[i]) - error_[i], std::max(x[i], y[i]) + error_[i], true};
  expression::Interval bounds;
  compiled_.bounds(box, std::span(&bounds, 1), interval_scratch_);
  return {bounds.low - level_, bounds.high - level_, bounds.defined};
}

double FunctionOnRay::noise(double u) const {
  const expression::Interval bounds = this->bounds(u, u);
  const double width = bounds.high - bounds.low;
  return bounds.defined && std::isfinite(width) ? width : nan;
}

glm::dvec3 FunctionOnRay::point(double u) const {
  glm::dvec3 x;
  for (int a = 0; a < 3; a++) x[a] = std::fma(along_[a], u, entry_[a]);
  return x;
}

bool is_within(const Domain& domain, const glm::dvec3& point) {
  constexpr double stored = std::numeric_limits<float>::epsilon();
  for (int a = 0; a < 3; a++) {
    const double slack = domain_slack * (domain.upper[a] - domain.lower[a]) + stored * std::abs(point[a]);
    if (!(point[a] >= domain.lower[a] - slack && point[a] <= domain.upper[a] + slack)) return false;
  }
  return domain.radius == 0 || glm::length(point) <= domain.radius * (1 + domain_slack + stored);
}

}  // namespace smurf
