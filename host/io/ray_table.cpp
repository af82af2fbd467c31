#include "io/ray_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/csv.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

std::vector<glm::vec3> vectors_of(const CsvColumns& table, std::size_t first) {
  std::vector<glm::vec3> vectors(table.rows);
  for (std::size_t i = 0; i < table.rows; i++)
    vectors[i] = {table.columns[first][i], table.columns[first + 1][i], table.columns[first + 2][i]};
  return vectors;
}

// Surface coordinates; none where the file has x or has no u, v.
PointTable read_places(const std::filesystem::path& file, const std::vector<std::string_view>& names) {
  const std::string_view part = names[0].empty() ? names[1] : names[0];
  const CsvColumns table = read_csv(file, {}, {"x", part, names[1], names[2]});
  PointTable result;
  if (table.present[0] || !table.present[1] || !table.present[2] || !table.present[3]) return result;
  for (std::size_t i = 0; i < table.rows; i++) {
    const float number = names[0].empty() ? 0.0f : table.columns[1][i];
    if (!(number >= 0.0f) || number != std::floor(number) || number > 16777216.0f)
      throw Error(ErrorCode::input,
                  fmt::format("\"{}\", row {}: column \"{}\" holds {}; it must be a whole number from 0", file.string(),
                              i + 1, part, number));
    result.places.push_back({std::uint32_t(number), table.columns[2][i], table.columns[3][i]});
  }
  return result;
}

}  // namespace

RayBatch read_rays(const std::filesystem::path& file) {
  // In the order of RayBatch::Component.
  const CsvColumns table = read_csv(file, {"ox", "oy", "oz", "dx", "dy", "dz"}, {"tmin", "tmax"});
  RayBatch rays(table.rows);
  for (int c = 0; c < RayBatch::component_count; c++)
    if (table.present[std::size_t(c)])
      std::ranges::copy(table.columns[std::size_t(c)], rays.component(RayBatch::Component(c)).begin());
  return rays;
}

PointTable read_points(const std::filesystem::path& file, const std::vector<std::string_view>& names) {
  if (names.size() == 3) {
    PointTable places = read_places(file, names);
    if (!places.places.empty()) return places;
  }
  const CsvColumns table = read_csv(file, {"x", "y", "z"}, {"dx", "dy", "dz"});
  const auto directions = std::count(table.present.begin() + 3, table.present.end(), true);
  if (directions != 0 && directions != 3)
    throw Error(ErrorCode::input, fmt::format("\"{}\": a direction needs all of the columns dx,dy,dz", file.string()));
  PointTable result;
  result.points = vectors_of(table, 0);
  result.has_directions = directions == 3;
  if (result.has_directions) result.directions = vectors_of(table, 3);
  return result;
}

}  // namespace smurf
