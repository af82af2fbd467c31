#include "reference/stream/map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "flows/kinds.hpp"
#include "reference/flow/extrapolation.hpp"
#include "reference/flow/line.hpp"
#include "reference/flow/variation.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr int looked_at = 512;       // seeds of a smooth part of the curve, between which it is inside or outside
constexpr double twin = 3e-5;        // how far the seeds of neighbouring lines are apart, of the stretch
constexpr double along_sine = 1e-9;  // of the angle of seed curve and flow, below which they are parallel
const dvec3 none(std::numeric_limits<double>::quiet_NaN());

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

// From values at u - h, u, u + h, or at u, u + h, u + 2h where one side is missing.
struct Stencil {
  std::array<double, 3> at{}, weight{};
};
Stencil stencil_of(const StreamStretch& stretch, double u) {
  const double h = twin * stretch.size();
  if (u - h < stretch.lower) return {{u, u + h, u + 2 * h}, {-1.5 / h, 2 / h, -0.5 / h}};
  if (u + h > stretch.upper) return {{u, u - h, u - 2 * h}, {1.5 / h, -2 / h, 0.5 / h}};
  return {{u, u + h, u - h}, {0, 0.5 / h, -0.5 / h}};
}

}  // namespace

ReferenceStreamMap::ReferenceStreamMap(const StreamSurface& surface)
    : flow_(refer(surface.field())),
      field_(surface.share_field()),
      seed_(surface.share_seed()),
      time_(surface.options().time),
      smooth_(surface.is_smooth()) {
  find_stretches();
  require_surface();
}

bool ReferenceStreamMap::is_inside(double u) const {
  const dvec3 x = seed_.share()->at(u).position;
  return flow_->find(x, slack_of(*flow_, x)).status == FlowStatus::inside;
}

void ReferenceStreamMap::find_stretches() {
  std::vector<double> ends = seed_.share()->corners();
  const glm::dvec2 range = seed_.share()->range();
  ends.insert(ends.begin(), range.x);
  ends.push_back(range.y);
  const auto border = [&](double in, double out) {
    for (int i = 0; i < 60; i++) {
      const double middle = 0.5 * (in + out);
      (is_inside(middle) ? in : out) = middle;
    }
    return in;
  };
  for (std::size_t part = 0; part + 1 < ends.size(); part++) {
    double before = ends[part], begin = before;
    bool inside = is_inside(before);
    for (int i = 1; i <= looked_at; i++) {
      const double here = i == looked_at ? ends[part + 1] : ends[part] + (ends[part + 1] - ends[part]) * i / looked_at;
      const bool now = is_inside(here);
      if (now && !inside) begin = border(here, before);
      if (!now && inside) stretches_.push_back({begin, border(before, here)});
      inside = now;
      before = here;
    }
    if (inside) stretches_.push_back({begin, ends[part + 1]});
  }
  std::erase_if(stretches_, [&](const StreamStretch& s) { return !(s.size() > 1e-12 * (range.y - range.x)); });
  if (stretches_.empty()) fail("seed: no place of the curve lies in the field's domain");
}

void ReferenceStreamMap::require_surface() const {
  bool moves = false, crosses = false;
  for (const StreamStretch& s : stretches_) {
    for (int i = 0; i < looked_at && !crosses; i++) {
      const double u = s.lower + s.size() * (i + 0.5) / looked_at;
      const SeedPoint seed = seed_.share()->at(u);
      const ReferenceFlow::Value field = flow_->at(seed.position, slack_of(*flow_, seed.position));
      if (field.place.status != FlowStatus::inside) continue;
      const double speed = glm::length(field.vector), length = glm::length(seed.first);
      moves = moves || speed > 0;
      crosses = glm::length(glm::cross(field.vector, seed.first)) > along_sine * speed * length;
    }
  }
  if (!moves) fail("seed: the field is zero all along the curve; nothing moves there");
  if (!crosses) fail("seed: the curve runs along the flow throughout, which makes a curve of the surface");
}

// Of a point that may lie beyond the domain: `last` is the piece that its line was in.
dvec3 ReferenceStreamMap::velocity(const dvec3& x, ReferencePlace& last) const {
  const ReferencePlace place = flow_->find(x, slack_of(*flow_, x));
  if (place.status == FlowStatus::inside) last = place;
  if (last.piece < 0) return none;
  dvec3 local = last.local;
  return flow_->locate(last.piece, x, local) ? flow_->value(last.piece, x, local) : none;
}

// `times` are without sign and begin with 0.
void ReferenceStreamMap::trace(const dvec3& seed, const std::vector<double>& times, double direction,
                               std::vector<dvec3>& x, std::vector<dvec3>& v, double& end) const {
  LineRequest request;
  request.time = direction * times.back();
  request.times = &times;
  ReferenceLine line = trace_line(*flow_, seed, request);
  end = std::abs(line.points.back().time);
  if (line.end != FlowStatus::time) {
    request.beyond = true;
    line = trace_line(*flow_, seed, request);
  } else {
    end = std::numeric_limits<double>::infinity();
  }
  ReferencePlace last;
  dvec3 far = seed, speed = velocity(seed, last);
  double far_time = 0;
  for (std::size_t i = 0; i < times.size(); i++) {
    if (i < line.points.size()) {
      const dvec3 there = line.points[i].position, found = velocity(there, last);
      far = there;
      far_time = std::abs(line.points[i].time);
      if (is_finite(found)) speed = found;
    }
    x.push_back(far + direction * (times[i] - far_time) * speed);
    v.push_back(speed);
  }
}

SampledLine ReferenceStreamMap::line(const StreamStretch& stretch, double u, const std::vector<double>& times) const {
  const dvec3 seed = seed_.share()->at(std::clamp(u, stretch.lower, stretch.upper)).position;
  std::vector<double> back{0}, forth{0};
  for (const double t : times) {
    if (t < 0) back.push_back(-t);
    if (t > 0) forth.push_back(t);
  }
  std::sort(back.begin() + 1, back.end());
  std::vector<dvec3> back_x, back_v, x, v;
  SampledLine result;
  const double infinity = std::numeric_limits<double>::infinity();
  double end = infinity;
  result.from = -infinity;
  result.until = infinity;
  if (back.size() > 1) {
    trace(seed, back, -1, back_x, back_v, end);
    result.from = -end;
  }
  trace(seed, forth, 1, x, v, end);
  if (forth.size() > 1) result.until = end;
  std::size_t b = back.size(), f = 1;
  for (const double t : times) {
    if (t < 0) b--;
    result.x.push_back(t < 0 ? back_x[b] : t == 0 ? seed : x[f]);
    result.v.push_back(t < 0 ? back_v[b] : t == 0 ? v[0] : v[f]);
    if (t > 0) f++;
  }
  return result;
}

ReferenceStreamMap::Spot ReferenceStreamMap::at(double u, double time) const {
  const dvec3 seed = seed_.share()->at(u).position;
  const std::vector<double> times{0, std::abs(time)};
  Spot spot;
  ReferencePlace last;
  if (time == 0) {
    spot.x = seed;
    spot.v = velocity(seed, last);
    spot.reached = true;
    return spot;
  }
  LineRequest request;
  request.time = time;
  request.times = &times;
  const ReferenceLine line = trace_line(*flow_, seed, request);
  spot.end = line.points.back().time;
  spot.reached = line.end == FlowStatus::time;
  spot.x = line.points.back().position;
  spot.v = velocity(spot.x, last);
  if (!is_finite(spot.v) && line.points.size() > 1)
    spot.v = (spot.x - line.points[line.points.size() - 2].position) / spot.end;
  if (!spot.reached) spot.x += (time - spot.end) * spot.v;
  return spot;
}

dvec3 ReferenceStreamMap::along(const StreamStretch& stretch, double u, double time) const {
  const Stencil stencil = stencil_of(stretch, std::clamp(u, stretch.lower, stretch.upper));
  dvec3 sum(0.0);
  for (std::size_t i = 0; i < 3; i++)
    if (stencil.weight[i] != 0) sum += stencil.weight[i] * at(stencil.at[i], time).x;
  return sum;
}

ReferenceStreamMap::Jet ReferenceStreamMap::jet(const StreamStretch& stretch, double u, double time) const {
  Jet jet{none, none, none, none, none, none};
  // A polyline has the tangents of this side there.
  u = std::clamp(u, stretch.lower + 1e-12 * stretch.size(), stretch.upper - 1e-12 * stretch.size());
  const SeedPoint seed = seed_.share()->at(u);
  jet.x = seed.position;
  jet.u = seed.first;
  if (smooth_) jet.uu = seed.second;
  if (time != 0) {
    const std::vector<double> times{0, std::abs(time)};
    LineRequest request;
    request.time = time;
    request.times = &times;
    const ReferenceLine line = trace_line(*flow_, seed.position, request);
    const std::size_t last = line.points.size() - 1;
    // Rounded times may pass the end by as much.
    if (line.end != FlowStatus::time && std::abs(line.points[last].time) < std::abs(time) * (1 - 0x1p-22)) return jet;
    const LineVariation by_u = vary_line(*flow_, line, request, seed.first, seed.second, smooth_ ? 2 : 1);
    jet.x = line.points[last].position;
    jet.u = by_u.first[last];
    if (smooth_) jet.uu = by_u.second[last];
  }
  const ReferenceFlow::Value field = flow_->at(jet.x, slack_of(*flow_, jet.x));
  jet.v = field.vector;
  if (!smooth_ || field.place.status != FlowStatus::inside) return jet;
  const glm::dmat3 by_x = flow_->jacobian(field.place, jet.x);
  jet.uv = by_x * jet.u;
  jet.vv = by_x * jet.v;
  return jet;
}

}  // namespace smurf
