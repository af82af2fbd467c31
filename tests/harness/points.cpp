#include "harness/points.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "harness/tolerances.hpp"

namespace smurf::test {
namespace {

class Comparison {
 public:
  explicit Comparison(PointErrors& errors) : errors_(errors) {}

  void at(std::size_t i) {
    i_ = i;
    errors_.compared++;
  }
  void check(const char* what, double error, double allowed) {
    if (allowed == not_compared) return;
    PointErrors::Worst& worst = errors_.worst[what];
    const double part = std::isnan(error) ? HUGE_VAL : error / allowed;
    if (part > worst.error) worst = {part, i_};
  }

 private:
  PointErrors& errors_;
  std::size_t i_ = 0;
};

}  // namespace

double PointErrors::of(const std::string& quantity) const {
  const auto found = worst.find(quantity);
  return found == worst.end() ? 0 : found->second.error;
}

std::string PointErrors::summary() const {
  std::string text;
  for (const auto& [what, found] : worst) text += fmt::format(" {} {:.2g}", what, found.error);
  return text;
}

PointErrors compare_points(const PointProperties& p, std::span<const glm::vec3> points, std::size_t count,
                           const PointOracle& oracle, std::span<const glm::vec3> directions,
                           std::span<const float> along) {
  constexpr double rounding = tolerance(Quantity::frame, any_kind).value;
  PointErrors errors;
  Comparison comparison(errors);
  for (std::size_t i = 0; i < std::min(points.size(), count); i++) {
    const auto truth = oracle(i, glm::dvec3(points[i]));
    if (!truth) continue;
    comparison.at(i);
    const Differential& exact = truth->exact;
    comparison.check("defined", p.status[i] & PointStatus::undefined ? 1 : 0, 0.5);
    if (!p.normal.empty())
      comparison.check("normal", glm::length(glm::dvec3(p.normal[i]) - exact.normal), truth->normal);
    if (!p.mean.empty()) comparison.check("mean", std::abs(p.mean[i] - exact.mean), truth->mean);
    if (!p.gauss.empty()) comparison.check("gauss", std::abs(p.gauss[i] - exact.gauss), truth->gauss);
    if (!p.k1.empty()) {
      comparison.check("k1", std::abs(p.k1[i] - exact.k1), truth->principal);
      comparison.check("k2", std::abs(p.k2[i] - exact.k2), truth->principal);
      comparison.check("k1 >= k2", p.k1[i] >= p.k2[i] ? 0 : 1, 0.5);
    }
    if (!along.empty())
      comparison.check("normal curvature",
                       std::abs(along[i] - normal_curvature_along(exact, glm::dvec3(directions[i]))), truth->along);
    if (p.d1.empty()) continue;
    const glm::dvec3 d1(p.d1[i]), d2(p.d2[i]);
    if (!(p.status[i] & PointStatus::umbilic)) {
      comparison.check("d1", glm::length(glm::cross(d1, exact.d1)), truth->direction);
      comparison.check("d2", glm::length(glm::cross(d2, exact.d2)), truth->direction);
    }
    comparison.check("|d1|", std::abs(glm::length(d1) - 1), rounding);
    comparison.check("d1·d2", std::abs(glm::dot(d1, d2)), rounding);
    if (!p.normal.empty()) comparison.check("d1·normal", std::abs(glm::dot(d1, glm::dvec3(p.normal[i]))), rounding);
  }
  return errors;
}

void expect_points(const PointErrors& errors, std::span<const glm::vec3> points, const std::string& where) {
  for (const auto& [what, found] : errors.worst) {
    if (found.error <= 1) continue;
    const glm::vec3 p = points[found.at];
    ADD_FAILURE() << where << ": " << what << " errs by " << found.error << " times what is allowed at point "
                  << found.at << fmt::format(" ({:.9g}, {:.9g}, {:.9g})", p.x, p.y, p.z) << ", of " << errors.compared
                  << " compared";
  }
}

}  // namespace smurf::test
