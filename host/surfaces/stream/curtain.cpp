// Samples of a stream surface along its streamlines, and the curtain through its seed curve.
#include "surfaces/stream/curtain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr double along_flow = 1e-6;  // the sine of the angle between c' and v below which they are parallel
constexpr int curtain_pieces = 48;
constexpr double trace_tolerance = 1e-5;  // of the extent
constexpr int most_steps = 100000;

[[noreturn]] void refuse(const std::string& message) { throw Error(ErrorCode::input, message); }

double length_of(const glm::dvec3& v) { return glm::length(v); }

// Streamlines from evenly spread seeds; without an error where nothing moves.
Streamlines trace(FlowQueries& flow, const StreamSurface& surface, const FlowSeeds& seeds, double time,
                  double interval) {
  TraceOptions options;
  options.time = time;
  options.interval = interval;
  options.tolerance = trace_tolerance * surface.field_extent();
  options.step = std::abs(time);
  options.most_steps = most_steps;
  return flow.trace(seeds, options);
}

// Why there is no surface, from the field at its seeds.
void require_surface(FlowQueries& flow, const FlowSeeds& seeds) {
  std::vector<glm::vec3> points;
  for (const glm::dvec3& p : seeds.positions) points.emplace_back(p);
  const FlowSamples samples = flow.sample(points, 0);
  std::size_t inside = 0, moving = 0, across = 0;
  for (std::size_t i = 0; i < points.size(); i++) {
    if (samples.status[i] != FlowStatus::inside) continue;
    inside++;
    const glm::dvec3 v(samples.value[i]), c = seeds.tangents[i];
    if (!(length_of(v) > 0)) continue;
    moving++;
    // Where the curve has no tangent nothing is known.
    if (!std::isfinite(c.x + c.y + c.z) || length_of(glm::cross(v, c)) > along_flow * length_of(v) * length_of(c))
      across++;
  }
  const glm::dvec3& p = seeds.positions.front();
  if (inside == 0)
    refuse(
        fmt::format("seed: no point of the curve lies in the field; it begins at ({:g}, {:g}, {:g})", p.x, p.y, p.z));
  if (moving == 0) refuse("seed: the field is zero along the curve; nothing moves there");
  if (across == 0) refuse("seed: the curve runs along the flow throughout; there is no surface");
}

}  // namespace

StreamSamples sample_stream(FlowQueries& flow, const StreamSurface& surface, std::size_t lines, std::size_t times) {
  const FlowSeeds seeds = surface.seed().sample(lines);
  require_surface(flow, seeds);
  const glm::dvec2 range = surface.seed().range(), time = surface.options().time;
  StreamSamples out;
  out.lines = lines;
  out.times = times;
  out.points.resize(lines * times);
  out.there.assign(lines * times, false);
  const double step = (time.y - time.x) / double(times - 1);
  glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
  double greatest_gap = 0;  // between where a line begins and where it ends
  // Each way what a line keeps is near the times that are wanted, by less than half of the interval.
  for (const double end : {time.x, time.y}) {
    const bool back = end == time.x;
    if (back ? !(end < 0) : !(end > 0)) continue;
    const Streamlines traced = trace(flow, surface, seeds, end, 0.5 * step);
    for (std::size_t i = 0; i < lines; i++) {
      if (traced.offsets[i] < traced.offsets[i + 1]) {
        const std::size_t first = traced.offsets[i], last = traced.offsets[i + 1] - 1;
        const bool arrives = std::abs(double(traced.times[last]) - end) <= 1e-6 * std::abs(end);
        const double off = double(glm::distance(traced.positions[first], traced.positions[last]));
        greatest_gap = std::max(greatest_gap, arrives ? off : std::numeric_limits<double>::infinity());
      } else {
        greatest_gap = std::numeric_limits<double>::infinity();
      }
      for (std::size_t k = traced.offsets[i]; k < traced.offsets[i + 1]; k++) {
        const double tau = traced.times[k];
        if (tau < time.x || tau > time.y) continue;
        const auto j = std::size_t(std::clamp((tau - time.x) / step + 0.5, 0.0, double(times - 1)));
        const glm::dvec3 p(traced.positions[k]);
        lower = glm::min(lower, p);
        upper = glm::max(upper, p);
        out.points[i * times + j] = {p, std::lerp(range.x, range.y, double(i) / double(lines - 1)), tau};
        out.there[i * times + j] = true;
      }
    }
  }
  if (!(lower.x <= upper.x)) refuse(fmt::format("time: every streamline ends before {:g}", time.x));
  out.bounds = {lower, upper};
  const glm::dvec3 size = upper - lower;
  constexpr double closing = 1e-5;  // of the extent, for lines are traced in floats
  out.closed_in_time = (time.x == 0 || time.y == 0) && greatest_gap <= closing * std::max({size.x, size.y, size.z});
  return out;
}

Curtain make_curtain(FlowQueries& flow, const StreamSurface& surface, bool closed) {
  const glm::dvec2 range = surface.seed().range();
  std::vector<double> places;
  for (int i = 0; i <= curtain_pieces; i++) places.push_back(std::lerp(range.x, range.y, i / double(curtain_pieces)));
  for (const double corner : surface.seed().corners()) places.push_back(corner);
  std::sort(places.begin(), places.end());
  Curtain curtain;
  std::vector<glm::dvec3> tangents;
  std::vector<glm::vec3> points;
  for (const double u : places) {
    const SeedPoint p = surface.seed().at(u);
    if (!curtain.position.empty() && length_of(p.position - curtain.position.back()) == 0) continue;
    if (!curtain.position.empty()) curtain.length += length_of(p.position - curtain.position.back());
    curtain.u.push_back(u);
    curtain.position.push_back(p.position);
    tangents.push_back(p.first);
    points.emplace_back(p.position);
  }
  const FlowSamples samples = flow.sample(points, 0);
  std::vector<glm::dvec3> across(points.size(), glm::dvec3(0.0));
  std::size_t known = 0;
  for (std::size_t i = 0; i < points.size(); i++) {
    if (samples.status[i] != FlowStatus::inside) continue;
    const glm::dvec3 v(samples.value[i]);
    // Where the curve has no tangent, along its neighbours.
    glm::dvec3 c = tangents[i];
    if (!std::isfinite(c.x + c.y + c.z) || length_of(c) == 0)
      c = curtain.position[std::min(i + 1, points.size() - 1)] - curtain.position[i > 0 ? i - 1 : 0];
    const glm::dvec3 r = glm::cross(v, c);
    if (!(length_of(r) > along_flow * length_of(v) * length_of(c))) continue;
    across[i] = glm::normalize(r);
    curtain.speed += length_of(v);
    known++;
  }
  if (known == 0) refuse("seed: the curve runs along the flow throughout, as far as it lies in the field");
  curtain.speed /= double(known);
  // Where v is along the curve, or there is none, the direction is that of the nearest place that has one.
  curtain.across = across;
  for (std::size_t i = 0; i < points.size(); i++) {
    if (across[i] != glm::dvec3(0.0)) continue;
    for (std::size_t away = 1; away < points.size(); away++) {
      const bool after = i + away < points.size() && across[i + away] != glm::dvec3(0.0);
      const bool before = i >= away && across[i - away] != glm::dvec3(0.0);
      if (!after && !before) continue;
      curtain.across[i] = across[before ? i - away : i + away];
      break;
    }
  }
  if (closed && curtain.across.size() > 2) curtain.across.back() = curtain.across.front();
  return curtain;
}

Lattice make_lattice(const Bounds& bounds, int longest) {
  const glm::dvec3 size = bounds.upper - bounds.lower;
  const double extent = std::max({size.x, size.y, size.z});
  Lattice lattice;
  // A cell and a half beyond the surface on each side.
  lattice.cell = extent / double(longest - 3);
  for (int axis = 0; axis < 3; axis++)
    lattice.cells[axis] = std::clamp(int(std::ceil(size[axis] / lattice.cell + 3)), 4, longest);
  lattice.corner = 0.5 * (bounds.lower + bounds.upper) - 0.5 * lattice.cell * glm::dvec3(lattice.cells);
  return lattice;
}

}  // namespace smurf
