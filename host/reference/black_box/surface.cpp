// Black boxes, answered by the reference, which asks the function that the user gave for the host, in double precision.
//
// Rays are sampled eight times as finely as devices do, evenly, whatever is known of the gradient. Changes of sign are
// followed by Brent's method, and taken for roots where |f| then falls with the distance from the place found; least
// values of |f| among neighbours of one sign are looked into by golden sections. Derivatives are central differences,
// with steps for double precision.
#include "surfaces/black_box/definition.hpp"
#include "surfaces/kinds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "reference/implicit/function_on_ray.hpp"
#include "reference/surface.hpp"
#include "reference/walk/level_set.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double finer = 8;
constexpr double flat = 1e-6;  // as of expressions; differences of differences round to more
// Beside a root by a millionth of a sample, f changes by less than this part of its change between samples.
constexpr double beside = 1e-6, jump = 0.1;

struct Sample {
  double s, f;
};

class BlackBoxReference : public ReferenceSurface {
 public:
  explicit BlackBoxReference(const BlackBoxSurface& surface) : surface_(surface) {}

  void roots(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const override {
    const auto range = clipped_range(surface_.domain, ray);
    if (!range) return;
    const auto [enter, leave] = *range;
    const auto f = [&](double s) { return value(ray.origin + (enter + s) * ray.direction) - surface_.options.level; };
    const double length = leave - enter, speed = glm::length(ray.direction);
    const int count = 1 + int(std::ceil(finer * length * speed / surface_.options.step));
    const double gap = length / count;
    Sample before{0, nan}, last{0, f(0)};
    for (int i = 1; i <= count && !(first_only && !hits.empty()); i++) {
      const Sample next{i == count ? length : i * gap, f(i == count ? length : i * gap)};
      if (crosses(last, next)) add_root(f, last, next, gap, std::abs(next.f - last.f), enter, hits);
      if (const auto lowest = lowest_between(f, before, last, next)) {
        const double change = std::max(std::abs(before.f), std::abs(next.f));
        add_root(f, before, *lowest, gap, change, enter, hits);
        add_root(f, *lowest, next, gap, change, enter, hits);
      }
      before = last;
      last = next;
    }
  }

  ReferencePoint measure(const glm::dvec3& point, const SurfaceCoordinates*) const override {
    if (!is_within(surface_.domain, point)) return {nan, undefined_frame()};
    const double f = value(point);
    if (!std::isfinite(f)) return {nan, undefined_frame()};
    glm::dvec3 gradient;
    for (int axis = 0; axis < 3; axis++) gradient[axis] = first_difference(point, axis);
    const auto along = [&](int a, int b, double sign) {
      glm::dvec3 direction(0.0);
      direction[a] += 1;
      direction[b] += sign;
      return second_difference(point, direction);
    };
    glm::dmat3 hessian;
    for (int a = 0; a < 3; a++) {
      hessian[a][a] = along(a, a, 0);
      for (int b = a + 1; b < 3; b++) hessian[a][b] = hessian[b][a] = 0.25 * (along(a, b, 1) - along(a, b, -1));
    }
    return {f, level_set_frame(gradient, hessian, 1, flat / surface_.diagonal())};
  }

  ReferenceWalker begin_walk(const glm::dvec3& point, const SurfaceCoordinates*, const glm::dvec3& direction,
                             double tolerance) const override {
    return smurf::begin_walk(level_set(), *this, point, direction, tolerance);
  }

  ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const override {
    return step_of_walk(level_set(), *this, from, distance);
  }

  std::size_t bytes() const override { return sizeof *this; }

  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition&) const override { return nullptr; }

 private:
  LevelSet level_set() const {
    return {[this](const glm::dvec3& p) -> std::optional<double> {
              if (!is_within(surface_.domain, p)) return std::nullopt;
              const double f = value(p);
              return std::isfinite(f) ? f - surface_.options.level : nan;
            },
            surface_.options.step};
  }

  double value(const glm::dvec3& point) const { return surface_.function.value(point); }

  // 0 counts as positive.
  static bool crosses(const Sample& a, const Sample& b) {
    return std::isfinite(a.f) && std::isfinite(b.f) && (a.f < 0) != (b.f < 0);
  }

  template <class Function>
  void add_root(const Function& f, const Sample& a, const Sample& b, double gap, double change, double enter,
                std::vector<ReferenceHit>& hits) const {
    const double root = bracketed_root(f, a.s, b.s, a.f, b.f);
    const double near = beside * gap;
    const double below = f(root - near), above = f(root + near);
    if (!(std::abs(above - below) <= jump * change)) return;  // also where one is not a number
    const double t = enter + root;
    const double uncertainty = 4 * std::numeric_limits<double>::epsilon() * (std::abs(t) + std::abs(enter));
    hits.push_back({t,
                    uncertainty,
                    HitStatus::bracketed,
                    (above - below) / (2 * near),
                    std::numeric_limits<double>::infinity(),
                    {}});
  }

  // A place between three samples of one sign, the least in the middle, where f has the other sign or is 0.
  template <class Function>
  static std::optional<Sample> lowest_between(const Function& f, const Sample& a, const Sample& m, const Sample& b) {
    if (!std::isfinite(a.f) || !std::isfinite(m.f) || !std::isfinite(b.f) || crosses(a, m) || crosses(m, b)) return {};
    const double sign = a.f < 0 ? -1 : 1;
    if (!(sign * m.f <= sign * a.f && sign * m.f <= sign * b.f) || (m.f == a.f && m.f == b.f)) return {};
    double low = a.s, high = b.s;
    constexpr double golden = 0.6180339887498949;
    Sample left{high - golden * (high - low), 0}, right{low + golden * (high - low), 0};
    left.f = sign * f(left.s);
    right.f = sign * f(right.s);
    for (int i = 0; i < 60; i++) {
      const Sample& least = left.f < right.f ? left : right;
      if (!std::isfinite(least.f)) return {};
      if (least.f <= 0) return Sample{least.s, sign * least.f};
      if (left.f < right.f) {
        high = right.s;
        right = left;
        left.s = high - golden * (high - low);
        left.f = sign * f(left.s);
      } else {
        low = left.s;
        left = right;
        right.s = low + golden * (high - low);
        right.f = sign * f(right.s);
      }
    }
    return {};
  }

  int reach() const { return surface_.options.difference_order / 2; }

  double first_difference(const glm::dvec3& point, int axis) const {
    static constexpr std::array<std::array<double, 3>, 3> weights{
        {{1.0 / 2}, {2.0 / 3, -1.0 / 12}, {3.0 / 4, -3.0 / 20, 1.0 / 60}}};
    const double h = surface_.difference_step(1, 53);
    double sum = 0;
    for (int k = 1; k <= reach(); k++) {
      glm::dvec3 offset(0.0);
      offset[axis] = k * h;
      sum += weights[std::size_t(reach() - 1)][std::size_t(k - 1)] * (value(point + offset) - value(point - offset));
    }
    return sum / h;
  }

  double second_difference(const glm::dvec3& point, const glm::dvec3& direction) const {
    static constexpr std::array<std::array<double, 4>, 3> weights{
        {{-2.0, 1.0}, {-5.0 / 2, 4.0 / 3, -1.0 / 12}, {-49.0 / 18, 3.0 / 2, -3.0 / 20, 1.0 / 90}}};
    const std::array<double, 4>& weight = weights[std::size_t(reach() - 1)];
    const double h = surface_.difference_step(2, 53);
    double sum = weight[0] * value(point);
    for (int k = 1; k <= reach(); k++)
      sum += weight[std::size_t(k)] * (value(point + k * h * direction) + value(point - k * h * direction));
    return sum / (h * h);
  }

  const BlackBoxSurface surface_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_black_box(const SurfaceDefinition& definition) {
  const auto& surface = dynamic_cast<const BlackBoxSurface&>(definition);
  if (!surface.function.value)
    throw Error(ErrorCode::usage,
                "the black box \"" + surface.function.name +
                    "\" has no function for the host, which the reference asks: give one in C++ (BlackBox::value), or "
                    "as the description's \"equation\"; devices answer without it");
  return std::make_shared<BlackBoxReference>(surface);
}

}  // namespace smurf
