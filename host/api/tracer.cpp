// Tracer: options and seeds are checked, and defaults put in, before a device or the reference traces.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "flows/queries.hpp"
#include "smurf/error.hpp"
#include "smurf/flow.hpp"

namespace smurf {
namespace {

constexpr double default_tolerance = 1e-6;   // of the extent
constexpr double default_steps = 200;        // rk4: of the time
constexpr double default_stagnation = 1e-6;  // of the greatest speed
constexpr int lattice = 16;                  // points along each axis, less one

[[noreturn]] void misuse(const std::string& message) { throw Error(ErrorCode::usage, message); }
[[noreturn]] void refuse(const std::string& message) { throw Error(ErrorCode::input, message); }

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void require_positive(double value, const char* what) {
  if (!(value >= 0) || !std::isfinite(value))
    misuse(fmt::format("{} must be positive, or 0 for the default, not {}", what, value));
}

void require_list(const std::vector<glm::dvec3>& list, const FlowSeeds& seeds, const char* what) {
  if (!list.empty() && list.size() != seeds.positions.size())
    misuse(fmt::format("there are {} {} for {} seeds; there must be one for each, or none", list.size(), what,
                       seeds.positions.size()));
  for (std::size_t i = 0; i < list.size(); i++) {
    if (!finite(list[i])) refuse(fmt::format("the {} of seed {} are not finite", what, i));
  }
}

void require_seeds(const FlowSeeds& seeds, const TraceOptions& options) {
  if (seeds.positions.empty()) refuse("there is no seed; a line needs a point to begin at");
  for (std::size_t i = 0; i < seeds.positions.size(); i++) {
    const glm::dvec3& p = seeds.positions[i];
    if (!finite(p)) refuse(fmt::format("seed {} is ({}, {}, {}); it must be finite", i, p.x, p.y, p.z));
  }
  require_list(seeds.tangents, seeds, "tangents");
  require_list(seeds.second_tangents, seeds, "second tangents");
  if (options.variation > 0 && seeds.tangents.empty())
    misuse("the variation of lines needs the tangents of their seeds, c'(u)");
}

TraceOptions completed(TraceOptions options, const VectorFieldDefinition& field) {
  if (!std::isfinite(options.time) || options.time == 0)
    misuse(fmt::format("the time must be finite and not 0, not {}", options.time));
  require_positive(options.step, "the step");
  require_positive(options.tolerance, "the tolerance");
  require_positive(options.interval, "the interval between positions");
  require_positive(options.length, "the length");
  require_positive(options.stagnation, "the speed of stagnation");
  if (options.most_steps < 1) misuse(fmt::format("at least one step must be allowed, not {}", options.most_steps));
  if (options.variation < 0 || options.variation > 2)
    misuse(fmt::format("the variation must be 0, 1 or 2 derivatives, not {}", options.variation));
  if (options.variation == 2 && field.smoothness() < 2)
    misuse(
        fmt::format("second derivatives of lines need a field with two continuous derivatives; this {} is trilinear, "
                    "ask for the reconstruction \"tricubic\"",
                    field.kind()));
  const Bounds bounds = field.bounds();
  const glm::dvec3 size = bounds.upper - bounds.lower;
  const double extent = std::max({size.x, size.y, size.z});
  if (options.both) options.time = std::abs(options.time);  // lines that go both ways are in order of time
  if (options.step == 0) options.step = std::abs(options.time) / default_steps;
  if (options.tolerance == 0) options.tolerance = default_tolerance * extent;
  return options;
}

// The greatest speed that is known: of samples, or on a lattice over the domain.
double greatest_speed(FlowQueries& queries, const VectorFieldDefinition& field) {
  if (!std::isnan(field.greatest_speed())) return field.greatest_speed();
  if (queries.greatest_speed) return *queries.greatest_speed;
  const Bounds bounds = field.bounds();
  std::vector<glm::vec3> points;
  for (int k = 0; k <= lattice; k++) {
    for (int j = 0; j <= lattice; j++) {
      for (int i = 0; i <= lattice; i++)
        points.emplace_back(glm::mix(bounds.lower, bounds.upper, glm::dvec3(i, j, k) / double(lattice)));
    }
  }
  const FlowSamples samples = queries.sample(points, 0);
  double greatest = 0;
  for (std::size_t i = 0; i < points.size(); i++) {
    if (samples.status[i] == FlowStatus::inside)
      greatest = std::max(greatest, glm::length(glm::dvec3(samples.value[i])));
  }
  queries.greatest_speed = greatest;
  return greatest;
}

// Says what is wrong where no line has left its seed.
void require_motion(const FlowSeeds& seeds, const Streamlines& lines, const Bounds& bounds) {
  std::size_t inside = 0;
  for (std::size_t i = 0; i < lines.size(); i++) {
    if (lines.offsets[i + 1] - lines.offsets[i] > 1) return;
    inside += lines.end[i] == FlowStatus::stagnation;
  }
  if (inside > 0)
    refuse(
        inside == lines.size()
            ? fmt::format("the field is zero at all {} seeds; nothing moves there", inside)
            : fmt::format("the field is zero at {} of {} seeds, and the others lie outside of it; nothing moves there",
                          inside, lines.size()));
  const glm::dvec3 &a = bounds.lower, &b = bounds.upper, &p = seeds.positions.front();
  const FlowStatus why = lines.end.front();
  refuse(
      fmt::format("no seed lies in the field; the first, at ({:g}, {:g}, {:g}), is {}; the field reaches from ({:g}, "
                  "{:g}, {:g}) to ({:g}, {:g}, {:g})",
                  p.x, p.y, p.z,
                  why == FlowStatus::blanked     ? "in a blanked cell"
                  : why == FlowStatus::undefined ? "where the field has no value"
                                                 : "outside of the domain",
                  a.x, a.y, a.z, b.x, b.y, b.z));
}

}  // namespace

std::string_view name_of(FlowStatus status) {
  switch (status) {
    case FlowStatus::inside:
      return "inside";
    case FlowStatus::time:
      return "time";
    case FlowStatus::domain:
      return "domain";
    case FlowStatus::blanked:
      return "blanked";
    case FlowStatus::stagnation:
      return "stagnation";
    case FlowStatus::steps:
      return "steps";
    case FlowStatus::length:
      return "length";
    case FlowStatus::undefined:
      return "undefined";
  }
  return "unknown";
}

Tracer::Tracer(const Device& device, const VectorField& field, const PrepareOptions& options)
    : device_(device),
      field_(field),
      queries_(device.is_reference() ? trace_by_reference(field.model())
                                     : trace_on_device(device_.executor(), field.share(), options)) {}

Streamlines Tracer::trace(const FlowSeeds& seeds, const TraceOptions& options) const {
  TraceOptions complete = completed(options, field_.model());
  require_seeds(seeds, complete);
  if (complete.stagnation == 0) complete.stagnation = default_stagnation * greatest_speed(*queries_, field_.model());
  Streamlines lines = queries_->trace(seeds, complete);
  require_motion(seeds, lines, field_.bounds());
  return lines;
}

FlowSamples Tracer::sample(std::span<const glm::vec3> points, int derivatives) const {
  if (derivatives < 0 || derivatives > 2)
    misuse(fmt::format("a field has up to 2 derivatives to be asked for, not {}", derivatives));
  return queries_->sample(points, derivatives);
}

std::size_t Tracer::device_bytes() const { return queries_->device_bytes(); }

}  // namespace smurf
