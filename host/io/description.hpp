// Reading descriptions (JSON) and their members, with messages that name the member as a path ("field.file").
#pragma once

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/error.hpp"
#include "smurf/surface.hpp"

namespace smurf::description {

// The member `name` of `object`, which stands at `path` in the description (empty: the description itself).
// Each throws Error (input) when the member is missing or of another type.
const nlohmann::json& member(const nlohmann::json& object, std::string_view path, std::string_view name);
const nlohmann::json& object_member(const nlohmann::json& object, std::string_view path, std::string_view name);
std::string text_member(const nlohmann::json& object, std::string_view path, std::string_view name);
double number_member(const nlohmann::json& object, std::string_view path, std::string_view name);

// Throws Error (input) on a member that is none of the known: a misspelt option must not be passed over.
void only_members(const nlohmann::json& object, std::string_view path, std::initializer_list<std::string_view> known);

std::string join(std::string_view path, std::string_view name);
std::string shown(const nlohmann::json& value);  // for messages: one line, shortened

// A number, or an expression of constants and of `parameters` such as "2*pi", that stands at `path`.
double constant(const nlohmann::json& value, const std::string& path, const Parameters& parameters = {});
// A range such as [0, "2*pi"], the lesser number first: the member `name` of `object`.
glm::dvec2 range(const nlohmann::json& object, std::string_view path, std::string_view name,
                 const Parameters& parameters = {});
// Three numbers, that stand at `path`.
glm::dvec3 three_numbers(const nlohmann::json& value, const std::string& path);
// Three expressions in `variables`, as texts; a constant may be written as a number.
std::array<std::string, 3> three_expressions(const nlohmann::json& object, std::string_view path, std::string_view name,
                                             std::string_view variables);
// "domain": [[x, y, z], [x, y, z]], or "radius": of a ball about the origin, or both.
std::optional<Domain> domain(const nlohmann::json& object, std::string_view path);
Domain required_domain(const nlohmann::json& object, std::string_view path);
// "parameters": {"a": 1.5}, none where there are none.
Parameters parameters(const nlohmann::json& object, std::string_view path);

// The JSON of a file, comments ignored. Throws Error (input) without the file's name; `what` says what it should be.
nlohmann::json parse(const std::filesystem::path& file, std::string_view what);
// How the file's name ends, in small letters.
std::string ending_of(const std::filesystem::path& file);
// The error that names the file in front, unless it does so already.
[[noreturn]] void fail_in(const std::filesystem::path& file, const Error& error);

// What `make` throws names the member.
template <class Make>
auto named(std::string_view path, std::string_view name, Make make) {
  try {
    return make();
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("member \"{}\": {}", join(path, name), error.what()));
  }
}

// The reader in `readers` that the member "kind" of `object` names; `what` says what the kinds are kinds of.
template <class Reader>
const Reader& reader_of(const std::map<std::string, Reader>& readers, const nlohmann::json& object,
                        std::string_view path, std::string_view what) {
  const std::string kind = text_member(object, path, "kind");
  const auto found = readers.find(kind);
  if (found != readers.end()) return found->second;
  std::vector<std::string_view> known;
  for (const auto& reader : readers) known.push_back(reader.first);
  throw Error(ErrorCode::input, fmt::format("member \"{}\" is \"{}\", which is no known kind; known {}: {}",
                                            join(path, "kind"), kind, what, fmt::join(known, ", ")));
}

}  // namespace smurf::description
