// Stream surfaces from descriptions (JSON).
#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "flows/kinds.hpp"
#include "flows/seeds/seed_curve.hpp"
#include "io/description.hpp"
#include "smurf/error.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

template <class Choice, std::size_t count>
Choice choice_member(const json& object, const char* name, Choice otherwise,
                     const std::array<std::pair<const char*, Choice>, count>& choices) {
  const auto found = object.find(name);
  if (found == object.end()) return otherwise;
  std::string known;
  for (const auto& [text, choice] : choices) {
    if (*found == text) return choice;
    known += fmt::format("{}\"{}\"", known.empty() ? "" : (text == choices.back().first ? " or " : ", "), text);
  }
  fail(fmt::format("member \"{}\" must be {}, not {}", name, known, description::shown(*found)));
}

constexpr std::array<std::pair<const char*, StreamMethod>, 2> methods{
    {{"explicit", StreamMethod::mesh}, {"back-stream", StreamMethod::back_stream}}};
constexpr std::array<std::pair<const char*, StreamDerivatives>, 4> derivative_names{
    {{"interpolated", StreamDerivatives::interpolated},
     {"integrated", StreamDerivatives::integrated},
     {"mesh", StreamDerivatives::mesh},
     {"neighbours", StreamDerivatives::neighbours}}};

bool flag_member(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) return false;
  if (!found->is_boolean())
    fail(fmt::format("member \"{}\" must be true or false, not {}", name, description::shown(*found)));
  return found->get<bool>();
}

}  // namespace

std::shared_ptr<const SurfaceDefinition> read_stream(const json& root, const std::filesystem::path& folder) {
  description::only_members(root, "",
                            {"kind", "time", "method", "field", "seed", "tolerance", "derivatives", "polish"});
  StreamOptions options;
  options.time = description::range(root, "", "time", {});
  options.method = choice_member(root, "method", StreamMethod::mesh, methods);
  options.derivatives = choice_member(root, "derivatives", StreamDerivatives::interpolated, derivative_names);
  options.polish = flag_member(root, "polish");
  if (root.contains("tolerance")) {
    options.tolerance = description::number_member(root, "", "tolerance");
    if (!(options.tolerance > 0))
      fail(fmt::format("member \"tolerance\" must be positive, not {}", description::shown(root["tolerance"])));
  }
  const auto field = read_flow(description::object_member(root, "", "field"), "field", folder);
  const auto seed = read_seed_curve(description::object_member(root, "", "seed"), "seed");
  try {
    return std::make_shared<const StreamSurface>(VectorField(field), SeedLine(seed), options);
  } catch (const Error& error) {
    // "time: ...", "tolerance: ..."
    const std::string what = error.what();
    const auto end = std::min(what.find(": "), what.size());
    throw Error(error.code(), fmt::format("member \"{}\"{}", what.substr(0, end), what.substr(end)));
  }
}

}  // namespace smurf
