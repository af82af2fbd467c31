// Seeds from descriptions (JSON) and from tables of points (CSV).
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

#include "flows/seeds/seed_curve.hpp"
#include "io/csv.hpp"
#include "io/description.hpp"
#include "smurf/error.hpp"

namespace smurf {

using nlohmann::json;

namespace {

constexpr std::size_t usual_count = 100, greatest_count = 100'000'000;

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

std::vector<glm::dvec3> read_points_member(const json& object, std::string_view path) {
  const std::string name = description::join(path, "points");
  const json& list = description::member(object, path, "points");
  if (!list.is_array())
    fail(fmt::format("member \"{}\" must be a list of points such as [[0, 0, 0], [1, 0, 0]], not {}", name,
                     description::shown(list)));
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < list.size(); i++)
    points.push_back(description::three_numbers(list[i], fmt::format("{}[{}]", name, i)));
  return points;
}

bool flag_member(const json& object, std::string_view path, std::string_view name) {
  const auto found = object.find(std::string(name));
  if (found == object.end()) return false;
  if (!found->is_boolean())
    fail(fmt::format("member \"{}\" must be true or false, not {}", description::join(path, name),
                     description::shown(*found)));
  return found->get<bool>();
}

std::shared_ptr<const SeedCurve> read_expressions(const json& object, std::string_view path) {
  description::only_members(object, path, {"position", "u", "parameters"});
  const std::array<std::string, 3> position = description::three_expressions(object, path, "position", "u");
  const Parameters parameters = description::parameters(object, path);
  const glm::dvec2 range = description::range(object, path, "u", parameters);
  try {
    return expression_seeds(position, range, parameters);
  } catch (const Error& error) {
    // "position[0]: ..." and "position: ..." name the member.
    const std::string what = error.what();
    const auto end = std::min(what.find(": "), what.size());
    throw Error(error.code(),
                fmt::format("member \"{}\"{}", description::join(path, what.substr(0, end)), what.substr(end)));
  }
}

std::size_t read_count(const json& object, std::size_t without) {
  const auto found = object.find("count");
  if (found == object.end()) return without;
  const double count = description::number_member(object, "", "count");
  if (!(count >= 1 && count <= double(greatest_count)) || count != std::floor(count))
    fail(fmt::format("member \"count\" must be a whole number from 1 to {}, not {}", greatest_count,
                     description::shown(*found)));
  return std::size_t(count);
}

FlowSeeds seeds_of(json root) {
  if (!root.is_object())
    fail("seeds are an object with \"points\", or with \"position\" and \"u\", not " + description::shown(root));
  if (root.contains("kind") && root["kind"] == "stream")
    return read_seed_curve(description::object_member(root, "", "seed"), "seed")->sample(usual_count);
  const bool bare = root.contains("points") && root["points"].is_array() && !root.contains("spline");
  const std::size_t count = read_count(root, bare ? root["points"].size() : usual_count);
  root.erase("count");
  return read_seed_curve(root, "")->sample(count);
}

FlowSeeds read_seed_table(const std::filesystem::path& file) {
  const CsvDoubles table = read_csv_doubles(file, {"x", "y", "z"}, {"dx", "dy", "dz"});
  if (table.rows == 0)
    fail(fmt::format("\"{}\": no point below the header; a seed is a row with x,y,z", file.string()));
  const bool some = table.present[3] || table.present[4] || table.present[5];
  const bool tangents = table.present[3] && table.present[4] && table.present[5];
  if (some && !tangents) fail(fmt::format("\"{}\": tangents need all of the columns dx,dy,dz", file.string()));
  const auto vectors = [&](std::size_t first, const char* what) {
    std::vector<glm::dvec3> list;
    list.reserve(table.rows);
    for (std::size_t i = 0; i < table.rows; i++) {
      const glm::dvec3 v(table.columns[first][i], table.columns[first + 1][i], table.columns[first + 2][i]);
      if (!std::isfinite(v.x + v.y + v.z))
        fail(fmt::format("\"{}\", row {}: the {} ({}, {}, {}) is not finite", file.string(), i + 1, what, v.x, v.y,
                         v.z));
      list.push_back(v);
    }
    return list;
  };
  FlowSeeds seeds;
  seeds.positions = vectors(0, "seed");
  if (tangents) seeds.tangents = vectors(3, "tangent");
  return seeds;
}

}  // namespace

std::shared_ptr<const SeedCurve> read_seed_curve(const json& object, std::string_view path) {
  if (object.contains("position")) return read_expressions(object, path);
  if (!object.contains("points"))
    fail(fmt::format("{}a seed curve has \"points\", or \"position\" and \"u\"; neither is there",
                     path.empty() ? "" : fmt::format("member \"{}\": ", path)));
  description::only_members(object, path, {"points", "spline"});
  const bool smooth = flag_member(object, path, "spline");
  std::vector<glm::dvec3> points = read_points_member(object, path);
  return description::named(path, "points",
                            [&] { return smooth ? spline_seeds(points) : polyline_seeds(std::move(points)); });
}

FlowSeeds load_seeds(const std::filesystem::path& file) {
  if (description::ending_of(file) == ".csv") return read_seed_table(file);
  if (description::ending_of(file) != ".json")
    fail(fmt::format("{}: seeds are read from .csv (columns x,y,z) and .json (a curve)", file.string()));
  try {
    return seeds_of(description::parse(file, "a description of seeds"));
  } catch (const Error& error) {
    description::fail_in(file, error);
  }
}

}  // namespace smurf
