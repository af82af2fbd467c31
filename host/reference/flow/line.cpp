#include "reference/flow/line.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "reference/flow/dop853.hpp"
#include "reference/flow/extrapolation.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using State = Dop853Step::State;  // position, and arc length

constexpr double shortest = 1e-14;   // step, as a part of the whole time
constexpr double on_face = 1e-13;    // of a piece's coordinates
constexpr int parts = 8;             // of a step, between which its way through the piece is looked at
constexpr double beyond_border = 1;  // of a piece's coordinates, for lines that go on

class Tracing {
 public:
  Tracing(const ReferenceFlow& flow, const dvec3& seed, const LineRequest& request)
      : flow_(flow),
        request_(request),
        direction_(request.time < 0 ? -1 : 1),
        total_(std::abs(request.time)),
        scale_(request.tolerance * extent_of(flow)),
        y_(seed, 0.0) {}

  ReferenceLine run() {
    line_.points.push_back({0, position()});
    place_ = flow_.find(position(), slack_of(flow_, position()));
    if (place_.status != FlowStatus::inside) {
      line_.end = place_.status;
      return std::move(line_);
    }
    enter();
    while (line_.end == FlowStatus::inside) advance();
    if (line_.points.back().time != direction_ * time_) line_.points.push_back({direction_ * time_, position()});
    return std::move(line_);
  }

 private:
  dvec3 position() const { return {y_}; }

  bool slope(const State& y, State& slope) const {
    dvec3 local = place_.local;
    if (!flow_.locate(place_.piece, dvec3(y), local)) return false;
    const dvec3 v = flow_.value(place_.piece, dvec3(y), local);
    if (!is_finite(v)) return false;
    slope = State(direction_ * v, glm::length(v));
    return true;
  }

  // Begins in place_. Where the line does not lie in it quite, the piece is taken to be as large as it must be.
  void enter() {
    dvec3 local = place_.local;
    if (flow_.locate(place_.piece, position(), local)) place_.local = local;
    lower_ = glm::min(dvec3(0.0), place_.local) - on_face;
    upper_ = glm::max(dvec3(1.0), place_.local) + on_face;
    ball_ = std::max(1.0, glm::length(position()) / flow_.radius()) + on_face;
  }

  double beyond(const dvec3& point, const dvec3& local) const {
    double most = glm::length(point) / flow_.radius() - ball_;
    for (int axis = 0; axis < 3; axis++)
      most = std::max({most, lower_[axis] - local[axis], local[axis] - upper_[axis]});
    return most;
  }

  double beyond_at(double theta) const {
    dvec3 local = place_.local;
    const dvec3 point(step_.at(theta));
    return flow_.locate(place_.piece, point, local) ? beyond(point, local) : 1;
  }

  // The part of the step at which it leaves the piece: between its samples, or about an extremum of a coordinate.
  std::optional<double> exit() const {
    std::array<double, parts + 1> out{};
    for (int i = 0; i <= parts; i++) out[std::size_t(i)] = beyond_at(double(i) / parts);
    for (int i = 1; i <= parts; i++) {
      const auto at = std::size_t(i);
      if (out[at] > 0) return bisect(double(i - 1) / parts, double(i) / parts);
      if (i == parts) break;
      // The parabola through three samples, where its top lies between them.
      const double slope = 0.5 * (out[at + 1] - out[at - 1]), bend = out[at + 1] - 2 * out[at] + out[at - 1];
      if (!(bend < 0) || std::abs(slope) > -bend || out[at] - 0.5 * slope * slope / bend < -1e-3) continue;
      const double top = (i - slope / bend) / parts;
      if (beyond_at(top) > 0) return bisect(double(i - 1) / parts, top);
    }
    return {};
  }

  double bisect(double in, double out) const {
    for (int i = 0; i < 48; i++) {
      const double middle = 0.5 * (in + out);
      (beyond_at(middle) > 0 ? out : in) = middle;
    }
    return out;
  }

  template <class Reached>
  double first_place(const Reached& reached) const {
    double before = 0, after = 1;
    for (int i = 0; i < 52; i++) {
      const double middle = 0.5 * (before + after);
      (reached(step_.at(middle)) ? after : before) = middle;
    }
    return after;
  }

  double speed_at(const State& y) const {
    State s;
    return slope(y, s) ? s.w : std::numeric_limits<double>::infinity();
  }

  // The piece ahead of a line that is at the border of its own. False where that is its own.
  bool cross(const dvec3& way) {
    const double size = flow_.size(place_.piece);
    for (const double ahead : {1e-10, 1e-8, 1e-6}) {
      const ReferencePlace next = flow_.find(position() + ahead * size * way, 0);
      if (next.status != FlowStatus::inside) {
        leave(next.status);
        return true;
      }
      if (next.piece == place_.piece) continue;
      place_ = next;
      enter();
      return true;
    }
    return false;
  }

  void leave(FlowStatus status) {
    if (request_.beyond && !gone_) {
      gone_ = true;
      lower_ = dvec3(-beyond_border);
      upper_ = dvec3(1 + beyond_border);
      ball_ = std::numeric_limits<double>::infinity();
    } else {
      line_.end = status;
    }
  }

  void advance() {
    State start;
    if (!slope(y_, start)) {
      line_.end = FlowStatus::undefined;
      return;
    }
    if (start.w <= request_.stagnation) {
      line_.end = FlowStatus::stagnation;
      return;
    }
    if (time_ >= total_ || line_.steps.size() >= std::size_t(request_.most_steps)) {
      line_.end = time_ >= total_ ? FlowStatus::time : FlowStatus::steps;
      return;
    }
    const dvec3 way = dvec3(start) / start.w;
    const auto f = [&](const State& y, State& s) { return slope(y, s); };
    if (wanted_ == 0) wanted_ = 0.02 * flow_.size(place_.piece) / start.w;
    double h = std::min(wanted_, total_ - time_);
    // Half a cell at once, so that samples of the step see what it does there.
    if (flow_.has_cells()) h = std::min(h, 0.7 * flow_.size(place_.piece) / start.w);
    if (forced_) h = std::min(h, 1e-6 * flow_.size(place_.piece) / start.w);
    if (h < shortest * total_ && h < total_ - time_) {
      stuck(way);
      return;
    }
    if (!step_.take(f, y_, start, h)) {
      wanted_ = 0.25 * h;
      return;
    }
    const double error = step_.error(scale_);
    const double factor = std::clamp(error > 0 ? 0.9 * std::pow(error, -1.0 / 8) : 6, 0.2, 6.0);
    if (error > 1) {
      wanted_ = h * factor;
      return;
    }
    if (!step_.densify(f)) {
      wanted_ = 0.25 * h;
      return;
    }
    const bool whole = h == total_ - time_;
    const std::optional<double> left = forced_ ? std::nullopt : exit();
    if (left) {
      h *= *left;
      // Taken anew, with the full order at its end.
      if (h < shortest * total_ || !step_.take(f, y_, start, h) || !step_.densify(f)) {
        forced_ = ++in_place_ > 4 || !cross(way);
        return;
      }
    } else {
      wanted_ = std::max(h * factor, h < wanted_ ? wanted_ : 0);
    }
    in_place_ = 0;
    accept(h, whole && !left);
    if (line_.end != FlowStatus::inside) return;
    if (left) {
      forced_ = !cross(dvec3(step_.end_slope()) / std::max(step_.end_slope().w, 1e-300));
    } else if (forced_) {
      forced_ = false;
      const ReferencePlace here = flow_.find(position(), slack_of(flow_, position()));
      if (here.status == FlowStatus::inside) {
        place_ = here;
        enter();
      } else {
        leave(here.status);
      }
    } else {
      dvec3 local = place_.local;
      if (flow_.locate(place_.piece, position(), local)) place_.local = local;
    }
  }

  // Ends within the step come before its end.
  void accept(double h, bool last) {
    double part = 1;
    FlowStatus end = FlowStatus::inside;
    if (step_.end().w >= request_.length) {
      part = first_place([&](const State& y) { return y.w >= request_.length; });
      end = FlowStatus::length;
    }
    const auto slow = [&](const State& y) { return speed_at(y) <= request_.stagnation; };
    if (slow(step_.end()) && !(part < 1 && !slow(step_.at(part)))) {
      part = std::min(part, first_place(slow));
      end = FlowStatus::stagnation;
    }
    const double until = last && part == 1 ? total_ : time_ + part * h;
    if (request_.interval > 0 || request_.times) {
      for (; has_next() && next_time() <= until; next_++) {
        const double theta = std::clamp((next_time() - time_) / h, 0.0, 1.0);
        line_.points.push_back({direction_ * next_time(), dvec3(step_.at(theta))});
      }
    } else {
      line_.points.push_back({direction_ * until, dvec3(part == 1 ? step_.end() : step_.at(part))});
    }
    y_ = part == 1 ? step_.end() : step_.at(part);
    time_ = until;
    line_.steps.push_back(part * h);
    line_.end = end;
  }

  // The end has a point of its own.
  bool has_next() const {
    if (request_.times) return next_ < request_.times->size() && next_time() < total_;
    return next_time() < total_ - 1e-9 * request_.interval;
  }
  double next_time() const { return request_.times ? (*request_.times)[next_] : double(next_) * request_.interval; }

  // Steps that have become as short as they may: at the border of where the field is defined.
  void stuck(const dvec3& way) {
    const double ahead = 1e-9 * flow_.size(place_.piece);
    const ReferencePlace next = flow_.find(position() + ahead * way, 0);
    line_.end = next.status == FlowStatus::inside ? FlowStatus::undefined : next.status;
  }

  const ReferenceFlow& flow_;
  const LineRequest request_;
  const double direction_, total_, scale_;
  State y_;
  double time_ = 0;
  ReferencePlace place_;
  dvec3 lower_{0.0}, upper_{1.0};  // of the piece's coordinates, for this line
  double ball_ = 1;
  double wanted_ = 0;     // length of the next step
  bool forced_ = false;   // the next step is tiny, and its way through pieces is not looked at
  int in_place_ = 0;      // crossings since the last step
  bool gone_ = false;     // beyond the border
  std::size_t next_ = 1;  // point
  Dop853Step step_;
  ReferenceLine line_;
};

}  // namespace

ReferenceLine trace_line(const ReferenceFlow& flow, const dvec3& seed, const LineRequest& request) {
  return Tracing(flow, seed, request).run();
}

std::vector<LinePoint> repeat_line(const ReferenceFlow& flow, const dvec3& piece_at, const dvec3& seed,
                                   double direction, const std::vector<double>& steps,
                                   const std::vector<double>& times) {
  const ReferencePlace place = flow.find(piece_at, slack_of(flow, piece_at));
  const auto f = [&](const State& y, State& slope) {
    dvec3 local = place.local;
    if (!flow.locate(place.piece, dvec3(y), local)) return false;
    const dvec3 v = flow.value(place.piece, dvec3(y), local);
    slope = State(direction * v, 0.0);
    return is_finite(v);
  };
  std::vector<LinePoint> points;
  State y(seed, 0.0), slope;
  double time = 0;
  std::size_t next = 0;
  if (!times.empty() && times[0] == 0) points.push_back({0, seed}), next = 1;
  Dop853Step step;
  for (std::size_t i = 0; i < steps.size(); i++) {
    if (!f(y, slope) || !step.take(f, y, slope, steps[i]) || !step.densify(f)) return points;
    const double until = time + steps[i];
    const bool last = i + 1 == steps.size();
    for (; next < times.size() && (last || times[next] <= until); next++)
      points.push_back({direction * times[next], dvec3(step.at(std::min(1.0, (times[next] - time) / steps[i])))});
    y = step.end();
    time = until;
  }
  return points;
}

}  // namespace smurf
