#include "reference/walk/charts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "reference/polynomial.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double on_border = 1e-11;      // of a rectangle's size; this far outside is rounding
constexpr double singular_sine = 1e-11;  // between x_u and x_v, and between the plane and the surface
constexpr double least_cosine = 0.97;    // of what the tangent turns by in a step
constexpr double shortest_turn = 1e-7;   // steps of this part of the chord that still turn are creases
constexpr double shortest_step = 1e-10;
constexpr int steps_of_chord = 40, steps_of_range = 16, most_steps = 100000, most_borders = 1000;

bool is_finite(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

class ChartCurve {
 public:
  ChartCurve(const Charts& charts, const SectionStart& start, const ChartPlace& place)
      : charts_(charts), start_(start), across_(start.across()) {
    enter(place);
  }

  SectionEnd follow() {
    const double r = start_.chord;
    const bool regular = use(charts_.point(now_.chart, now_.at)) && begin();
    if (!leave_pole() && !regular) return end(WalkStatus::undefined);
    double step = r / (4 * steps_of_chord);
    for (int i = 0; i < most_steps; i++) {
      step = std::min({step, r / steps_of_chord, range_step()});
      Trial trial = attempt(step);
      if (trial.fault == Fault::none && !trial.borders && glm::dot(trial.tangent, tangent_) < least_cosine &&
          step > shortest_turn * r)
        trial.fault = Fault::lost;
      if (trial.fault != Fault::none) {
        step *= 0.5;
        if (step >= shortest_step * r) continue;
        if (leave_pole()) {
          step = r / (4 * steps_of_chord);
          continue;
        }
        return end(trial.fault == Fault::ends        ? WalkStatus::boundary
                   : trial.fault == Fault::undefined ? WalkStatus::undefined
                                                     : WalkStatus::unresolved);
      }
      if (const auto far = leaves_circle(step, trial)) {
        take(attempt(*far));
        return end(creased_ ? WalkStatus::crease : WalkStatus::reached);
      }
      if (comes_back(step, trial)) {
        now_ = first_;
        here_.s = start_.location;
        return end(WalkStatus::unreachable);
      }
      if (!trial.borders && glm::dot(trial.tangent, tangent_) < section_crease_cosine) creased_ = true;
      take(trial);
      if (trial.borders) {
        if (!cross_border() && !leave_pole()) return end(WalkStatus::boundary);
        if (++borders_ > most_borders) break;
      } else {
        step *= 1.5;
      }
    }
    return end(WalkStatus::unresolved);
  }

 private:
  enum class Fault { none, lost, undefined, ends };
  struct Trial {
    ChartPlace place;
    ChartPoint point;
    dvec3 tangent{0.0};
    bool borders = false;
    Fault fault = Fault::none;
  };

  SectionEnd end(WalkStatus outcome) const {
    return {.location = here_.s, .outcome = outcome, .part = now_.chart, .u = now_.at.x, .v = now_.at.y};
  }

  void enter(const ChartPlace& place) {
    first_ = now_ = place;
    here_.s = start_.location;
  }

  bool use(const ChartPoint& point) {
    if (!is_finite(point.s) || !is_finite(point.u) || !is_finite(point.v) || point.ends) return false;
    here_ = point;
    return true;
  }

  double f(const dvec3& s) const { return glm::dot(s - start_.location, across_); }

  // The unit tangent of the section, with the sign of -sign·(x_u × x_v) × across; 0 where there is none.
  dvec3 tangent_of(const ChartPoint& p, double sign) const {
    const dvec3 n = glm::cross(p.u, p.v), t = glm::cross(across_, n);
    const double area = glm::length(n), size = glm::length(t);
    if (!(area > singular_sine * glm::length(p.u) * glm::length(p.v)) || !(size > singular_sine * area))
      return dvec3(0.0);
    return sign / size * t;
  }

  // Parameters that move by the tangent vector w.
  static dvec2 in_parameters(const ChartPoint& p, const dvec3& w) {
    const dvec3 n = glm::cross(p.u, p.v);
    const double square = glm::dot(n, n);
    return dvec2(glm::dot(glm::cross(w, p.v), n), glm::dot(glm::cross(p.u, w), n)) / square;
  }

  bool begin() {
    sign_ = glm::dot(glm::cross(here_.u, here_.v), start_.normal) < 0 ? -1 : 1;
    tangent_ = tangent_of(here_, sign_);
    if (tangent_ == dvec3(0.0)) return false;
    // across x n is the direction, but for rounding.
    if (glm::dot(tangent_, start_.direction) < 0) sign_ = -sign_, tangent_ = -tangent_;
    return true;
  }

  double range_step() const {
    const dvec2 rate =
        glm::abs(in_parameters(here_, tangent_)) / (charts_.upper(now_.chart) - charts_.lower(now_.chart));
    return 1 / (steps_of_range * std::max({rate.x, rate.y, 1e-300}));
  }

  // The part of the way from a to b that is in the rectangle, and the axis that ends it; -1 where none does.
  int first_border(const dvec2& a, dvec2& b) const {
    const dvec2 low = charts_.lower(now_.chart), high = charts_.upper(now_.chart);
    int axis_of_end = -1;
    double part = 1;
    for (int axis = 0; axis < 2; axis++) {
      const double room = on_border * (high[axis] - low[axis]);
      if (b[axis] >= low[axis] - room && b[axis] <= high[axis] + room) continue;
      const double wall = b[axis] < low[axis] ? low[axis] : high[axis];
      const double to_wall = std::clamp((wall - a[axis]) / (b[axis] - a[axis]), 0.0, 1.0);
      if (to_wall <= part) part = to_wall, axis_of_end = axis;
    }
    if (axis_of_end < 0) {
      b = glm::clamp(b, low, high);
      return -1;
    }
    const double wall = b[axis_of_end] < low[axis_of_end] ? low[axis_of_end] : high[axis_of_end];
    b = glm::clamp(a + part * (b - a), low, high);
    b[axis_of_end] = wall;
    return axis_of_end;
  }

  static Fault fault_of(const ChartPoint& p) {
    if (p.ends) return Fault::ends;
    return is_finite(p.s) && is_finite(p.u) && is_finite(p.v) ? Fault::none : Fault::undefined;
  }

  // A step of that length from where the curve has come to.
  Trial attempt(double step) const {
    Trial trial{now_, {}, {}, false, Fault::none};
    dvec2 at = now_.at + step * in_parameters(here_, tangent_);
    int axis = first_border(now_.at, at);
    double last = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 30; i++) {
      trial.point = charts_.point(now_.chart, at);
      trial.fault = fault_of(trial.point);
      if (trial.fault != Fault::none) return trial;
      const double off = f(trial.point.s);
      const dvec3 n = glm::cross(trial.point.u, trial.point.v);
      const double square = glm::dot(n, n);
      if (!(square > 0) && axis < 0) break;
      const dvec3 steepest = across_ - (square > 0 ? glm::dot(across_, n) / square * n : dvec3(0.0));
      if (std::abs(off) <= 4e-16 * size_of(trial.point.s) || (std::abs(off) >= last && i > 4)) break;
      last = std::abs(off);
      dvec2 next = at;
      if (axis < 0) {
        next += in_parameters(trial.point, -off / std::max(glm::dot(steepest, steepest), 1e-30) * steepest);
        axis = first_border(at, next);
      } else {
        const dvec3& along = axis == 0 ? trial.point.v : trial.point.u;
        const double slope = glm::dot(along, across_);
        if (std::abs(slope) <= 1e-13 * glm::length(along)) break;
        const double low = charts_.lower(now_.chart)[1 - axis], high = charts_.upper(now_.chart)[1 - axis];
        next[1 - axis] = std::clamp(next[1 - axis] - off / slope, low, high);
      }
      at = next;
    }
    trial.place.at = at;
    trial.borders = axis >= 0;
    const double moved = glm::distance(trial.point.s, here_.s);
    if (moved > 1.3 * step || std::abs(f(trial.point.s)) > 1e-9 * start_.chord) trial.fault = Fault::lost;
    if (!trial.borders && moved < 0.7 * step) trial.fault = Fault::lost;
    trial.tangent = tangent_of(trial.point, sign_);
    if (trial.tangent == dvec3(0.0) && !trial.borders) trial.fault = Fault::lost;
    return trial;
  }

  double size_of(const dvec3& s) const { return std::max(glm::length(s), glm::length(start_.location)); }

  void take(const Trial& trial) {
    moved_ = moved_ || glm::distance(trial.point.s, here_.s) > 1e-9 * start_.chord;
    now_ = trial.place;
    here_ = trial.point;
    if (trial.tangent != dvec3(0.0)) tangent_ = trial.tangent;
  }

  // Into the chart, at each side that the place is on.
  bool points_inwards(const ChartPlace& place, const ChartPoint& p, const dvec3& t) const {
    const dvec2 low = charts_.lower(place.chart), high = charts_.upper(place.chart), size = high - low;
    const dvec2 move = in_parameters(p, t) / size;
    const double slack = -1e-9 * glm::length(move);
    for (int axis = 0; axis < 2; axis++) {
      if (place.at[axis] <= low[axis] + on_border * size[axis] && move[axis] < slack) return false;
      if (place.at[axis] >= high[axis] - on_border * size[axis] && move[axis] > -slack) return false;
    }
    return true;
  }

  bool cross_border() { return go_on_at(charts_.same_point(now_), false); }

  bool leave_pole() {
    const auto places = charts_.around_pole(now_, start_);
    return !places.empty() && ++borders_ <= most_borders && go_on_at(places, true);
  }

  // At the place where the curve turns least; from a pole, away from it.
  bool go_on_at(const std::vector<ChartPlace>& places, bool from_pole) {
    double straightest = -0.9;  // not back
    bool found = false;
    const dvec3 from = here_.s;
    const dvec3 heading = tangent_ == dvec3(0.0) ? start_.direction : tangent_;
    for (const ChartPlace& place : places) {
      const ChartPoint p = charts_.point(place.chart, place.at);
      if (fault_of(p) != Fault::none) continue;
      for (const double sign : {1.0, -1.0}) {
        const dvec3 t = tangent_of(p, sign);
        const double straight = glm::dot(t, heading);
        if (t == dvec3(0.0) || straight <= straightest || !points_inwards(place, p, t)) continue;
        if (from_pole && glm::dot(t, p.s - from) <= 0) continue;
        straightest = straight;
        now_ = place;
        here_ = p;
        sign_ = sign;
        tangent_ = t;
        found = true;
      }
    }
    if (found && straightest < section_crease_cosine) creased_ = true;
    return found;
  }

  double chord_of(const Trial& trial) const { return glm::distance(trial.point.s, start_.location); }

  // The length of the step at which the curve is at the chord first, if it is within the step.
  std::optional<double> leaves_circle(double step, const Trial& trial) const {
    const double r = start_.chord, here = glm::distance(here_.s, start_.location);
    const auto beyond = [&](double s) { return chord_of(attempt(s)) - r; };
    double far = trial.borders ? std::min(step, 1.0001 * glm::distance(trial.point.s, here_.s)) : step;
    double excess = chord_of(trial) - r;
    if (excess < 0) {
      const bool turns = here > 0.9 * r && glm::dot(here_.s - start_.location, tangent_) > 0 && !trial.borders &&
                         glm::dot(trial.point.s - start_.location, trial.tangent) < 0;
      if (!turns) return std::nullopt;
      constexpr double golden = 0.6180339887498949;
      double low = 0, high = far;
      for (int i = 0; i < 50; i++) {
        const double a = high - golden * (high - low), b = low + golden * (high - low);
        if (beyond(a) > beyond(b)) high = b;
        else low = a;
      }
      far = 0.5 * (low + high);
      excess = beyond(far);
      if (excess < 0) return std::nullopt;
    } else if (beyond(far) < 0) {
      far = step;
      excess = beyond(far);
      if (excess < 0) return std::nullopt;
    } else {
      excess = beyond(far);
    }
    return bracketed_root(beyond, 0.0, far, here - r, excess);
  }

  bool comes_back(double step, const Trial& trial) const {
    const auto x = [&](const dvec3& s) { return glm::dot(s - start_.location, start_.direction); };
    // Borders may be where the start is, to rounding.
    const double before = x(here_.s), after = x(trial.point.s), rounding = 1e-9 * start_.chord;
    const bool passes = moved_ && before <= rounding && after > rounding;
    if (!passes || glm::distance(here_.s, start_.location) > 2 * step) return false;
    const auto f = [&](double s) { return s == 0 ? before : x(attempt(s).point.s); };
    const double part = before < 0 ? bracketed_root(f, 0.0, step, before, after) : 0;
    return chord_of(attempt(part)) <= 1e-6 * start_.chord;
  }

  const Charts& charts_;
  const SectionStart& start_;
  const dvec3 across_;
  ChartPlace first_, now_;
  ChartPoint here_;
  dvec3 tangent_{0.0};
  double sign_ = 1;
  bool creased_ = false, moved_ = false;
  int borders_ = 0;
};

}  // namespace

SectionEnd follow_section(const Charts& charts, const SectionStart& start, const ChartPlace& place) {
  return ChartCurve(charts, start, place).follow();
}

}  // namespace smurf
