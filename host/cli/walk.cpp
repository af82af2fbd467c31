// The verb `walk`: from points with directions to paths on a surface.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "io/ray_table.hpp"
#include "io/writers/path_file.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {
namespace {

constexpr std::size_t statuses = std::size_t(WalkStatus::invalid) + 1;

void check(const WalkCommand& command) {
  if (!(command.distance > 0 && std::isfinite(command.distance)))
    throw Error(ErrorCode::usage, fmt::format("--distance must be positive and finite, not {}", command.distance));
  if (command.steps < 1 || command.steps > 1000000000)
    throw Error(ErrorCode::usage, fmt::format("--steps must be 1 to 1000000000, not {}", command.steps));
  if (command.tolerance && !(*command.tolerance >= 0 && std::isfinite(*command.tolerance)))
    throw Error(ErrorCode::usage, fmt::format("--tolerance must be 0 or more, not {}", *command.tolerance));
}

// What is wrong with a point; empty where nothing is.
std::string fault_of(WalkStatus status) {
  switch (status) {
    case WalkStatus::off_surface:
      return "it is farther from the surface than --tolerance allows (by default a thousandth of the surface's extent)";
    case WalkStatus::no_direction:
      return "its direction has no part along the surface: it is zero, or along the normal";
    case WalkStatus::invalid:
      return "its numbers must be finite";
    default:
      return {};
  }
}

void refuse_bad_points(const Paths& paths, const std::filesystem::path& file) {
  for (std::size_t i = 0; i < paths.size(); i++) {
    const std::string fault = fault_of(paths.status[paths.offsets[i]]);
    if (!fault.empty())
      throw Error(ErrorCode::input, fmt::format("{}, line {}: this point cannot be walked from: {}", file.string(),
                                                line_of_row(file, i), fault));
  }
}

std::string ends_of(const Paths& paths) {
  std::array<std::size_t, statuses> counts{};
  for (std::size_t i = 0; i < paths.size(); i++) counts[std::size_t(paths.status[paths.offsets[i + 1] - 1])]++;
  std::string text;
  for (std::size_t i = 0; i < statuses; i++)
    if (counts[i] > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name_of(WalkStatus(i)), counts[i]);
  return text;
}

}  // namespace

void run_walk(const WalkCommand& command, const CommonOptions& common) {
  check_output(command.output, {".csv", ".vtp"});
  check(command);
  const Surface surface = load_surface(command.surface);
  const PointTable points = read_points(command.points);
  if (!points.has_directions)
    throw Error(ErrorCode::input, fmt::format("\"{}\" has no columns dx,dy,dz: walking needs a direction of each point",
                                              command.points.string()));
  const Device device = open(command.device, common);
  const Interrogator query = prepare(device, surface, command.surface, common);

  const Stopwatch watch;
  Paths paths;
  {
    Progress progress("walking", common.quiet);
    paths = query.walk(points.points, points.directions, float(command.distance), std::uint32_t(command.steps),
                       {.tolerance = float(command.tolerance.value_or(-1)), .progress = progress.callback()});
  }
  const double seconds = watch.seconds();
  refuse_bad_points(paths, command.points);
  const std::vector<std::string_view> names = surface.model().coordinate_names();
  write_paths(paths, names, command.output);
  if (common.verbose)
    fmt::print(stderr, "paths: {}, of {} rows; they end by {}\n", paths.size(), paths.status.size(), ends_of(paths));
  report(device, common, "steps", paths.status.size() - paths.size(), seconds);
}

}  // namespace smurf
