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
  const std::array<std::string, 3> position = description::three_expressions(root, "", "position", "u and v");
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
