// The verbs `devices` and `info`.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "cli/commands.hpp"
#include "cli/session.hpp"
#include "flows/definition.hpp"
#include "smurf/error.hpp"
#include "smurf/flow.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

namespace {

using Row = std::vector<std::string>;

void print_table(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); i++) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); i++)
      line += i + 1 == row.size() ? row[i] : fmt::format("{:<{}}  ", row[i], widths[i]);
    fmt::print("{}\n", line);
  }
}

std::string vector_text(const glm::dvec3& v) { return fmt::format("({:g}, {:g}, {:g})", v.x, v.y, v.z); }

// `what` is a surface or a vector field.
template <class What>
std::string memory_on_device(const What& what, const InfoOptions& options, const CommonOptions& common) {
  try {
    const Device device = open(options.device, common);
    const auto query = prepare(device, what, options.surface, common);
    return fmt::format("{} on {}:{} ({})", bytes_text(query.device_bytes()), device.info().executor,
                       device.info().index, device.info().name);
  } catch (const Error& error) {
    // Without --device the facts that need none are still worth telling.
    if (options.device_asked_for || error.code() != ErrorCode::usage) throw;
    return fmt::format("not known: {}", error.what());
  }
}

// `what` is a surface or a vector field.
template <class What>
void inform(const What& what, const InfoOptions& options, const CommonOptions& common) {
  // First, for a stream surface is traced by the first who asks, and that should be the device asked for.
  const std::string memory = memory_on_device(what, options, common);
  const Bounds bounds = naming(options.surface, [&] { return what.bounds(); });
  std::vector<Row> rows{{"kind", std::string(what.kind())},
                        {"bounds", fmt::format("{} to {}", vector_text(bounds.lower), vector_text(bounds.upper))}};
  for (const Fact& fact : what.model().facts()) rows.push_back({fact.name, fact.value});
  if constexpr (std::is_same_v<What, VectorField>) {
    for (const Fact& note : what.model().notes()) rows.push_back({note.name, note.value});
  }
  rows.push_back({"device memory", memory});
  print_table(rows);
}

}  // namespace

void run_devices() {
  std::vector<Row> rows{{"device", "memory", "largest buffer", "precision", "lanes", "name", "platform"}};
  for (const DeviceInfo& info : list_devices()) {
    rows.push_back({fmt::format("{}:{}", info.executor, info.index), info.memory ? bytes_text(info.memory) : "unknown",
                    info.largest_allocation ? bytes_text(info.largest_allocation) : "unlimited", info.precision,
                    fmt::format("{}", info.lanes), info.name, info.platform});
  }
  print_table(rows);
}

void run_info(const InfoOptions& options, const CommonOptions& common) {
  if (is_vector_field(options.surface)) inform(load_vector_field(options.surface), options, common);
  else inform(load_surface(options.surface), options, common);
}

}  // namespace smurf
