// The verb `trace`: from seeds to streamlines.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "cli/lines.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "flows/seeds/seed_curve.hpp"
#include "io/writers/line_file.hpp"
#include "smurf/error.hpp"

namespace smurf {

namespace {

constexpr std::size_t statuses = std::size_t(FlowStatus::undefined) + 1;
using Counts = std::array<std::size_t, statuses>;

// Seeds without a line, by what the field is there. A line of one row may also be one that leaves at once.
Counts seeds_without_flow(const Tracer& tracer, const FlowSeeds& seeds, const Streamlines& lines) {
  std::vector<glm::vec3> lone;
  for (std::size_t i = 0; i < lines.size(); i++)
    if (lines.offsets[i + 1] - lines.offsets[i] == 1) lone.emplace_back(seeds.positions[i]);
  Counts counts{};
  if (lone.empty()) return counts;
  for (const FlowStatus status : tracer.sample(lone).status) counts[std::size_t(status)]++;
  return counts;
}

std::string places_of(const Counts& counts, std::size_t seeds) {
  std::string text;
  const auto add = [&](FlowStatus status, std::string_view where) {
    const std::size_t count = counts[std::size_t(status)];
    if (count == 0) return;
    text += text.empty() ? fmt::format("{} of {} seeds {} {}", count, seeds, count == 1 ? "lies" : "lie", where)
                         : fmt::format(", {} {}", count, where);
  };
  add(FlowStatus::domain, "outside of the domain");
  add(FlowStatus::blanked, "in blanked cells");
  add(FlowStatus::undefined, "where the field is undefined");
  return text;
}

std::string ends_of(const Streamlines& lines) {
  Counts counts{};
  for (const FlowStatus status : lines.end) counts[std::size_t(status)]++;
  for (const FlowStatus status : lines.beginning)
    if (status != FlowStatus::inside) counts[std::size_t(status)]++;
  std::string text;
  for (std::size_t i = 0; i < statuses; i++)
    if (counts[i] > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name_of(FlowStatus(i)), counts[i]);
  return text;
}

// The options of one integrator do not go with the other.
TraceOptions options_of(const TraceCommand& command) {
  TraceOptions options = command.options;
  const bool fixed = command.integrator == "rk4";
  if (command.step && !fixed)
    throw Error(ErrorCode::usage, "--step goes with --integrator rk4; dormand-prince has --tolerance");
  if (command.tolerance && fixed)
    throw Error(ErrorCode::usage, "--tolerance goes with --integrator dormand-prince; rk4 has --step");
  const auto positive = [](const char* name, const std::optional<double>& value) {
    if (value && !(*value > 0 && std::isfinite(*value)))
      throw Error(ErrorCode::usage, fmt::format("{} must be positive, not {}", name, *value));
  };
  positive("--step", command.step);
  positive("--tolerance", command.tolerance);
  options.integrator = fixed ? Integrator::rk4 : Integrator::dormand_prince;
  options.step = command.step.value_or(0);
  options.tolerance = command.tolerance.value_or(0);
  return options;
}

FlowSeeds seeds_of(const TraceCommand& command, int variation) {
  FlowSeeds seeds = load_seeds(command.seeds);
  if (variation < 2) seeds.second_tangents.clear();
  if (variation < 1) seeds.tangents.clear();
  if (variation > 0 && seeds.tangents.empty())
    throw Error(ErrorCode::input,
                fmt::format("\"{}\": --variation needs the tangents of the seeds: columns dx,dy,dz, or a curve (JSON)",
                            command.seeds.string()));
  for (const auto* tangents : {&seeds.tangents, &seeds.second_tangents}) {
    for (std::size_t i = 0; i < tangents->size(); i++) {
      const glm::dvec3& v = (*tangents)[i];
      if (!std::isfinite(v.x + v.y + v.z))
        throw Error(ErrorCode::input,
                    fmt::format("{}: the curve has no {} derivative at seed {}, which --variation needs",
                                command.seeds.string(), tangents == &seeds.tangents ? "first" : "second", i));
    }
  }
  return seeds;
}

}  // namespace

Streamlines trace_lines(const Tracer& tracer, const FlowSeeds& seeds, TraceOptions options,
                        const CommonOptions& common) {
  Streamlines lines;
  {
    Progress progress("tracing lines", common.quiet);
    options.progress = progress.callback();
    lines = tracer.trace(seeds, options);
  }
  if (!common.quiet) {
    const std::string places = places_of(seeds_without_flow(tracer, seeds, lines), lines.size());
    if (!places.empty()) fmt::print(stderr, "smurf: {}\n", places);
  }
  if (common.verbose)
    fmt::print(stderr, "lines: {}, of {} rows; they end by {}\n", lines.size(), lines.times.size(), ends_of(lines));
  return lines;
}

void run_trace(const TraceCommand& command, const CommonOptions& common) {
  check_output(command.output, {".csv", ".vtp"});
  const TraceOptions options = options_of(command);
  const VectorField field = load_vector_field(command.field);
  const FlowSeeds seeds = seeds_of(command, options.variation);
  const Device device = open(command.device, common);
  const Tracer tracer = prepare(device, field, command.field, common);

  const Stopwatch watch;
  const Streamlines lines = trace_lines(tracer, seeds, options, common);
  const double seconds = watch.seconds();
  write_lines(lines, command.output);
  report(device, common, "steps", lines.steps, seconds);
}

}  // namespace smurf
