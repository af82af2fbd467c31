// Parametric surfaces and patches, from API calls and descriptions.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "expression/evaluate.hpp"
#include "expression/parser.hpp"
#include "io/description.hpp"
#include "io/patch_file.hpp"
#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "surfaces/parametric/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

std::array<bool, 2> read_period(const json& root) {
  std::array<bool, 2> closed{};
  const auto value = root.find("period");
  if (value == root.end()) return closed;
  const json list = value->is_string() ? json::array({*value}) : *value;
  bool fits = list.is_array();
  for (std::size_t i = 0; fits && i < list.size(); i++) {
    fits = list[i] == "u" || list[i] == "v";
    if (fits) closed[list[i] == "u" ? 0 : 1] = true;
  }
  if (!fits)
    fail(
        fmt::format("member \"period\" must list the parameters that the surface is closed in, as in [\"u\"] or "
                    "[\"u\", \"v\"], not {}",
                    description::shown(*value)));
  return closed;
}

std::array<std::string, 3> read_position(const json& root) {
  const json& value = description::member(root, "", "position");
  if (!value.is_array() || value.size() != 3)
    fail(fmt::format("member \"position\" must be three expressions in u and v, of x, y and z, not {}",
                     description::shown(value)));
  std::array<std::string, 3> position;
  for (std::size_t k = 0; k < 3; k++) {
    // A constant may be written as a number.
    if (value[k].is_number()) {
      position[k] = fmt::format("{}", value[k].get<double>());
    } else if (value[k].is_string() && !value[k].get_ref<const std::string&>().empty()) {
      position[k] = value[k].get<std::string>();
    } else {
      fail(fmt::format("member \"position[{}]\" must be an expression in u and v, not {}", k,
                       description::shown(value[k])));
    }
  }
  return position;
}

// `what` begins with the member that is wrong, where it is a single one: "position[0]: ...".
[[noreturn]] void fail_at_member(const Error& error) {
  const std::string what = error.what();
  const auto end = what.find(": ");
  for (const std::string_view name : {"position", "position[0]", "position[1]", "position[2]", "u", "v"}) {
    if (end != what.npos && std::string_view(what).substr(0, end) == name)
      throw Error(error.code(), fmt::format("member \"{}\"{}", name, what.substr(end)));
  }
  throw error;
}

}  // namespace

Surface parametric(const std::array<std::string, 3>& position, const glm::dvec2& u, const glm::dvec2& v,
                   const Parameters& parameters, const std::array<bool, 2>& closed) {
  return Surface(std::make_shared<const ParametricSurface>(
      ParametricExpressions{position, {u.x, v.x}, {u.y, v.y}, parameters, closed}));
}

Surface nurbs(std::vector<Patch> patches) {
  return Surface(std::make_shared<const ParametricSurface>(std::move(patches)));
}

Surface load_nurbs(const std::filesystem::path& file) {
  std::vector<Patch> patches = load_patches(file);
  try {
    return nurbs(std::move(patches));
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("\"{}\", {}", file.string(), error.what()));
  }
}

std::shared_ptr<const SurfaceDefinition> read_parametric(const json& root, const std::filesystem::path&) {
  description::only_members(root, "", {"kind", "position", "u", "v", "parameters", "period"});
  const std::array<std::string, 3> position = read_position(root);
  const Parameters parameters = description::parameters(root, "");
  const glm::dvec2 u = description::range(root, "", "u", parameters), v = description::range(root, "", "v", parameters);
  const std::array<bool, 2> closed = read_period(root);
  try {
    return parametric(position, u, v, parameters, closed).share();
  } catch (const Error& error) {
    fail_at_member(error);
  }
}

std::shared_ptr<const SurfaceDefinition> read_nurbs(const json& root, const std::filesystem::path& folder) {
  description::only_members(root, "", {"kind", "file"});
  const std::string file = description::text_member(root, "", "file");
  try {
    return load_nurbs(folder / file).share();
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("member \"file\": {}", error.what()));
  }
}

std::shared_ptr<const SurfaceDefinition> read_patch_file(const std::filesystem::path& file) {
  return load_nurbs(file).share();
}

}  // namespace smurf
