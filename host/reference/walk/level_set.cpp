#include "reference/walk/level_set.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "reference/polynomial.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;
constexpr double ahead = pi / 3;         // half of the arc that is looked at
constexpr double most_turned = 0.15;     // in a step
constexpr double shortest_turn = 1e-6;   // steps of this part of the chord that still turn are creases
constexpr double shortest_step = 1e-10;  // towards the end of the domain, as a part of the chord
constexpr int most_steps = 200000;
constexpr int steps_past_crease = 3;

double wrapped(double angle) { return std::remainder(angle, 2 * pi); }

enum class Arc { one, several, none, outside, undefined };

struct Crossing {
  Arc found = Arc::none;
  double angle = 0;
};

class PlaneCurve {
 public:
  PlaneCurve(const LevelSet& surface, const SectionStart& start) : surface_(surface), start_(start) {}

  SectionEnd follow() {
    const double r = start_.chord;
    const double longest = std::min(r / 48, surface_.scale);
    double step = longest / 4;
    if (!find_side(step)) return end(WalkStatus::undefined);
    for (int i = 0; i < most_steps; i++) {
      const Crossing next = ahead_of(step);
      const bool smooth = next.found == Arc::one && turns_little(step, next.angle);
      if (!smooth && next.found != Arc::outside && next.found != Arc::undefined && step <= shortest_turn * r) {
        if (!pass_crease(step)) return end(WalkStatus::unresolved);
        step = std::min(16 * step, longest);
        continue;
      }
      if (!smooth) {
        step *= 0.5;
        if (step >= shortest_step * r) continue;
        if (next.found == Arc::outside) return end(WalkStatus::boundary);
        return end(next.found == Arc::undefined ? WalkStatus::undefined : WalkStatus::unresolved);
      }
      const dvec2 there = place(step, next.angle);
      if (const auto exit = leaves_circle(step, there, next.angle)) {
        at_ = *exit;
        return end(creased_ ? WalkStatus::crease : WalkStatus::reached);
      }
      if (comes_back(step, there)) {
        at_ = dvec2(0.0);
        return end(WalkStatus::unreachable);
      }
      const double turn = wrapped(next.angle - heading_);
      at_ = there;
      heading_ = next.angle;
      step = std::min(longest, step * (std::abs(turn) < 0.5 * most_turned ? 1.6 : 1.0));
    }
    return end(WalkStatus::unresolved);
  }

 private:
  SectionEnd end(WalkStatus outcome) const { return {.location = world(at_), .outcome = outcome}; }
  dvec3 world(const dvec2& q) const { return start_.location + q.x * start_.direction + q.y * start_.normal; }
  dvec2 place(double radius, double angle) const { return at_ + radius * dvec2(std::cos(angle), std::sin(angle)); }
  std::optional<double> g(const dvec2& q) const { return surface_.value(world(q)); }

  // The side of the start on which g is positive.
  bool find_side(double step) {
    for (; step >= shortest_step * start_.chord; step *= 0.25) {
      const auto above = g(dvec2(0, step)), below = g(dvec2(0, -step));
      const bool known_above = above && std::isfinite(*above), known_below = below && std::isfinite(*below);
      if (known_above && known_below) {
        if ((*above > 0) == (*below > 0)) continue;
        side_ = *above > 0 ? 1 : -1;
        return true;
      }
      if (!known_above && !known_below) continue;
      side_ = known_above ? (*above > 0 ? 1 : -1) : (*below > 0 ? -1 : 1);
      return true;
    }
    return false;
  }

  // Where the curve meets the circle of that radius around the point, at angles from the heading within `reach`; `wide`
  // takes the one of the least turn.
  Crossing on_circle(double radius, double reach, int samples, bool wide) const {
    Crossing crossing;
    double before = 0, at_before = 0;
    bool outside = false, undefined = false, known_before = false;
    int count = 0;
    for (int i = 0; i <= samples; i++) {
      const double angle = heading_ - reach + 2 * reach * i / samples;
      const auto value = g(place(radius, angle));
      const bool known = value && std::isfinite(*value);
      outside = outside || !value;
      undefined = undefined || (value && !known);
      // On its left the curve has the side that is above the start.
      if (known && known_before && (side_ * before <= 0) && (side_ * *value > 0)) {
        const auto f = [&](double a) { return g(place(radius, a)).value_or(0.0); };
        const double root = bracketed_root(f, at_before, angle, before, *value);
        if (count == 0 || std::abs(wrapped(root - heading_)) < std::abs(wrapped(crossing.angle - heading_)))
          crossing.angle = root;
        count++;
      } else if (known && known_before && (side_ * before > 0) != (side_ * *value > 0) && !wide) {
        count += 2;  // another sheet
      }
      known_before = known;
      if (known) before = *value, at_before = angle;
    }
    if (count == 1 || (wide && count > 0)) crossing.found = Arc::one;
    else if (count > 1) crossing.found = Arc::several;
    else crossing.found = outside ? Arc::outside : (undefined ? Arc::undefined : Arc::none);
    return crossing;
  }

  Crossing ahead_of(double radius) const { return on_circle(radius, ahead, 12, false); }

  bool turns_little(double step, double angle) const {
    if (std::abs(wrapped(angle - heading_)) > most_turned) return false;
    const Crossing middle = ahead_of(0.5 * step);
    return middle.found == Arc::one && std::abs(wrapped(middle.angle - heading_)) <= most_turned;
  }

  // A few shortest steps, whatever the turn.
  bool pass_crease(double step) {
    const double before = heading_;
    for (int i = 0; i < steps_past_crease; i++) {
      const Crossing next = on_circle(step, 0.95 * pi, 90, true);
      if (next.found != Arc::one) return false;
      at_ = place(step, next.angle);
      heading_ = wrapped(next.angle);
    }
    if (std::cos(heading_ - before) < section_crease_cosine) creased_ = true;
    return ++creases_ <= 1000;
  }

  // The point at the chord on the step to `there`, if the step leaves the circle around the start.
  std::optional<dvec2> leaves_circle(double step, const dvec2& there, double angle) const {
    const double r = start_.chord;
    const auto beyond = [&](double radius) {
      const Crossing next = ahead_of(radius);
      return glm::length(place(radius, next.found == Arc::one ? next.angle : angle)) - r;
    };
    double far = step, excess = glm::length(there) - r;
    const double here = glm::length(at_) - r;
    if (excess < 0) {
      // Out and in again within the step, where the curve is at right angles to the radius.
      if (glm::length(at_) < 0.9 * r || glm::dot(at_, there - at_) <= 0) return std::nullopt;
      const dvec2 middle = place(0.5 * step, ahead_of(0.5 * step).angle);
      if (glm::dot(there - middle, there) > 0 && glm::dot(middle - at_, middle) > 0 &&
          glm::length(there) > glm::length(middle))
        return std::nullopt;
      constexpr double golden = 0.6180339887498949;
      double low = 0, high = step;
      for (int i = 0; i < 50; i++) {
        const double a = high - golden * (high - low), b = low + golden * (high - low);
        if (beyond(a) > beyond(b)) high = b;
        else low = a;
      }
      far = 0.5 * (low + high);
      excess = beyond(far);
      if (excess < 0) return std::nullopt;
    }
    const double radius = bracketed_root(beyond, 0.0, far, here, excess);
    const Crossing last = ahead_of(radius);
    return place(radius, last.found == Arc::one ? last.angle : angle);
  }

  // Whether the step to `there` passes through the start, in the start's direction.
  bool comes_back(double step, const dvec2& there) const {
    if (!(at_.x < 0 && there.x >= 0)) return false;
    const double slack = 2 * step;
    if (std::abs(at_.y) > slack || std::abs(there.y) > slack) return false;
    const auto along = [&](double radius) {
      const Crossing next = ahead_of(radius);
      return place(radius, next.angle);
    };
    const double radius =
        bracketed_root([&](double s) { return s == 0 ? at_.x : along(s).x; }, 0.0, step, at_.x, there.x);
    return std::abs(along(radius).y) <= 1e-5 * std::min(start_.chord, surface_.scale);
  }

  const LevelSet& surface_;
  const SectionStart& start_;
  double side_ = 1;
  dvec2 at_{0.0};
  double heading_ = 0;
  bool creased_ = false;
  int creases_ = 0;
};

}  // namespace

SectionEnd follow_section(const LevelSet& surface, const SectionStart& start) {
  return PlaneCurve(surface, start).follow();
}

std::optional<dvec3> level_set_along(const LevelSet& surface, const dvec3& p, const dvec3& direction, double reach) {
  const auto f = [&](double y) { return surface.value(p + y * direction); };
  const auto here = f(0);
  if (!here || !std::isfinite(*here)) return std::nullopt;
  if (*here == 0) return p;
  std::array<double, 2> last{0, 0}, value{*here, *here};
  std::array<bool, 2> going{true, true};
  for (double y = 1e-9 * reach; going[0] || going[1]; y *= 1.25) {
    const bool ends = y >= reach;
    for (std::size_t side = 0; side < 2; side++) {
      if (!going[side]) continue;
      const double next = (side == 0 ? 1 : -1) * std::min(y, reach);
      const auto there = f(next);
      going[side] = !ends && there && std::isfinite(*there);
      if (!there || !std::isfinite(*there)) continue;
      if ((*there > 0) != (value[side] > 0)) {
        const double root =
            bracketed_root([&](double s) { return f(s).value_or(0.0); }, last[side], next, value[side], *there);
        return p + root * direction;
      }
      last[side] = next;
      value[side] = *there;
    }
  }
  return std::nullopt;
}

ReferenceWalker begin_walk(const LevelSet& surface, const ReferenceSurface& frames, const dvec3& point,
                           const dvec3& direction, double tolerance) {
  const double size = std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)});
  dvec3 location = point, normal = frames.measure(point).frame.normal;
  // Along the normal, and from there once more.
  double reach = 1.01 * tolerance + 16 * double(0x1p-24f) * size;
  for (int i = 0; i < 2 && std::isfinite(glm::length(normal)); i++, reach *= 0.1) {
    const auto on = level_set_along(surface, location, normal, reach);
    if (!on && i == 0) return {.location = point, .status = WalkStatus::off_surface};
    if (!on) break;
    location = *on;
    normal = frames.measure(location).frame.normal;
  }
  return walk_start(point, location, normal, direction, tolerance);
}

ReferenceWalker step_of_walk(const LevelSet& surface, const ReferenceSurface& frames, const ReferenceWalker& from,
                             double distance) {
  const SectionEnd end = follow_section(surface, section_start(from, distance));
  return walk_end(from, end, frames.measure(end.location).frame.normal);
}

}  // namespace smurf
