// The verbs `cast` and `probe`: from a table of rays or points to a table of results.
#include <fmt/format.h>

#include <numeric>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/properties.hpp"
#include "cli/session.hpp"
#include "io/ray_table.hpp"
#include "io/result_table.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

namespace {

void refuse_bad_rays(const Surface& surface, const HitList& hits, const RayBatch& rays,
                     const std::filesystem::path& file) {
  for (std::size_t i = 0; i < hits.ray_count(); i++) {
    if (hits.ray_status()[i] == RayStatus::ok) continue;
    const Ray ray = rays[i];
    const std::string reason = ray.direction == glm::vec3(0.0f) ? "its direction is zero"
                               : ray.t_min > ray.t_max
                                   ? "tmin is greater than tmax"
                                   : fmt::format("its numbers must be finite{}", surface.model().ray_limits());
    throw Error(ErrorCode::input,
                fmt::format("{}, line {}: this ray cannot be cast: {}", file.string(), line_of_row(file, i), reason));
  }
}

// One column of a hit list, by its names; coordinates are told as a property. `status` holds the texts that the table
// shows.
template <class T>
void add_column(Table& table, std::string_view names, std::span<const T> values,
                std::vector<std::string_view>& status) {
  if constexpr (std::is_same_v<T, HitStatus>) {
    for (const HitStatus s : values) status.push_back(name_of(s));
    table.add(names, status);
  } else if constexpr (std::is_same_v<T, glm::vec3>) {
    const std::size_t y = names.find(',') + 1, z = names.find(',', y) + 1;
    table.add({names.substr(0, y - 1), names.substr(y, z - y - 1), names.substr(z)}, values);
  } else if constexpr (!std::is_same_v<T, SurfaceCoordinates>) {
    table.add(names, values);
  }
}

Table table_of(const Surface& surface, const HitList& hits, const std::vector<Property>& properties,
               std::vector<std::string_view>& status) {
  Table table;
  enum { before, behind };
  for (const int part : {before, behind}) {
    if (part == behind && !properties.empty())
      add_properties(table, properties, surface, hits.properties(bits_of(properties)));
#define HIT_COLUMN(name, type, names, place) \
  if (part == place) add_column<type>(table, names, hits.name(), status);
#include "smurf/hit_columns.def"
  }
  return table;
}

Hits hits_named(std::string_view name) {
  if (name == "first") return Hits::first;
  if (name == "any") return Hits::any;
  if (name == "count") return Hits::count;
  return Hits::all;
}

// A row per ray.
void write_counts(const HitList& hits, std::string_view name, const std::filesystem::path& file) {
  std::vector<std::uint32_t> rays(hits.ray_count());
  std::iota(rays.begin(), rays.end(), 0u);
  Table table;
  table.add("ray", rays);
  table.add(name, hits.counts());
  table.add("flagged", hits.flagged());
  write_table(table, file);
}

// What `probe` tells unless it is asked for something else.
std::string usual(const Surface& surface) {
  return surface.model().has_coordinates() ? "normal,gauss,mean,parameters" : "value,normal,gauss,mean";
}

}  // namespace

void run_cast(const CastCommand& command, const CommonOptions& common) {
  const Hits wanted = hits_named(command.hits);
  const bool counts = wanted == Hits::any || wanted == Hits::count;
  if (counts) {
    check_output(command.output, {".csv"});
  } else {
    check_output(command.output, {".csv", ".vtp"});
  }
  const Surface surface = load_surface(command.surface);
  const std::vector<Property> properties = properties_named(command.properties, surface);
  if (counts && !properties.empty())
    throw Error(ErrorCode::usage, fmt::format("--hits {} keeps no hits, so that --properties has nothing to measure; "
                                              "ask for all or first",
                                              command.hits));
  const RayBatch rays = read_rays(command.rays);
  const Device device = open(command.device, common);
  const Interrogator query = prepare(device, surface, command.surface, common);

  const Stopwatch watch;
  HitList hits;
  {
    Progress progress("casting rays", common.quiet);
    hits = query.cast(rays, {.hits = wanted, .properties = bits_of(properties), .progress = progress.callback()});
  }
  const double seconds = watch.seconds();
  refuse_bad_rays(surface, hits, rays, command.rays);
  if (counts) {
    write_counts(hits, wanted == Hits::any ? "hit" : "count", command.output);
    return report(device, common, "rays", rays.size(), seconds);
  }
  std::vector<std::string_view> status;
  write_table(table_of(surface, hits, properties, status), command.output);
  report(device, common, "rays", rays.size(), seconds);
}

void run_probe(const ProbeCommand& command, const CommonOptions& common) {
  check_output(command.output, {".csv", ".vtp"});
  const Surface surface = load_surface(command.surface);
  const std::vector<Property> properties = properties_named(command.properties.value_or(usual(surface)), surface);
  const PointTable points = read_points(command.points, surface.model().coordinate_names());
  const Device device = open(command.device, common);
  const Interrogator query = prepare(device, surface, command.surface, common);

  const Stopwatch watch;
  PointProperties values;
  {
    Progress progress("probing points", common.quiet);
    ProbeOptions options;
    options.progress = progress.callback();
    values = points.places.empty()
                 ? query.probe(points.points, bits_of(properties), options)
                 : query.properties_at(points.places, bits_of(properties) | Property::location, options);
  }
  const double seconds = watch.seconds();
  std::vector<std::string_view> status;
  for (const std::uint32_t bits : values.status) status.push_back(point_status_text(bits));
  Table table;
  table.add({"x", "y", "z"}, points.places.empty() ? std::span<const glm::vec3>(points.points) : values.location);
  table.add("status", status);
  add_properties(table, properties, surface, values);
  write_table(table, command.output);
  report(device, common, "points", values.status.size(), seconds);
}

}  // namespace smurf
