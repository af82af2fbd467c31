// Reading members of surface descriptions, with messages that name the member as a path ("field.file").
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/error.hpp"

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
