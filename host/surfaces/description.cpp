// Surface descriptions (JSON): which kinds there are, and the messages when one is wrong.
//
// A reader checks its own members and throws Error (input) that names the member; load_surface puts the
// name of the file in front.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "surfaces/description.hpp"
#include "surfaces/kinds.hpp"

namespace smurf {

using nlohmann::json;

std::string_view Surface::kind() const { return model_->kind(); }
Bounds Surface::bounds() const { return model_->bounds(); }

namespace description {

const json& member(const json& object, std::string_view path, std::string_view name) {
  const auto found = object.find(std::string(name));
  if (found == object.end()) throw Error(ErrorCode::input, fmt::format("member \"{}\" is missing", join(path, name)));
  return *found;
}

const json& object_member(const json& object, std::string_view path, std::string_view name) {
  const json& value = member(object, path, name);
  if (!value.is_object()) {
    throw Error(ErrorCode::input,
                fmt::format("member \"{}\" must be an object, not {}", join(path, name), shown(value)));
  }
  return value;
}

std::string text_member(const json& object, std::string_view path, std::string_view name) {
  const json& value = member(object, path, name);
  if (!value.is_string() || value.get_ref<const std::string&>().empty()) {
    throw Error(ErrorCode::input, fmt::format("member \"{}\" must be a string that is not empty, not {}",
                                              join(path, name), shown(value)));
  }
  return value.get<std::string>();
}

double number_member(const json& object, std::string_view path, std::string_view name) {
  const json& value = member(object, path, name);
  if (!value.is_number()) {
    throw Error(ErrorCode::input,
                fmt::format("member \"{}\" must be a finite number, not {}", join(path, name), shown(value)));
  }
  return value.get<double>();
}

void only_members(const json& object, std::string_view path, std::initializer_list<std::string_view> known) {
  for (const auto& item : object.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      throw Error(ErrorCode::input,
                  fmt::format("unknown member \"{}\"; known here: {}", join(path, item.key()), fmt::join(known, ", ")));
    }
  }
}

std::string join(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : fmt::format("{}.{}", path, name);
}

std::string shown(const json& value) {
  // Bytes that are no UTF-8 cannot come from a parsed file; replaced all the same rather than thrown upon.
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  constexpr std::size_t longest = 40;
  if (text.size() > longest) text = text.substr(0, longest) + "...";
  return text;
}

}  // namespace description

namespace {

// nlohmann's messages start with "[json.exception.parse_error.101] "; the rest is for people.
std::string plain(const json::exception& error) {
  std::string text = error.what();
  if (const auto end = text.find("] "); text.starts_with("[json.") && end != std::string::npos) text.erase(0, end + 2);
  return text;
}

json parse(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw Error(ErrorCode::input, "is a folder, not a surface description");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(ErrorCode::input, "cannot open this surface description: no such file, or not readable");
  try {
    return json::parse(stream, nullptr, true, /*ignore_comments=*/true);
  } catch (const json::exception& error) {
    throw Error(ErrorCode::input, "not valid JSON: " + plain(error));
  }
}

std::shared_ptr<const SurfaceDefinition> read(const json& root, const std::filesystem::path& folder) {
  if (!root.is_object())
    throw Error(ErrorCode::input, "a surface description is a JSON object, not " + description::shown(root));
  return description::reader_of(surface_readers(), root, "", "surfaces")(root, folder);
}

}  // namespace

std::shared_ptr<const SurfaceDefinition> read_isosurface(const json& root, const std::filesystem::path& folder) {
  description::only_members(root, "", {"kind", "isovalue", "field"});
  const double isovalue = description::number_member(root, "", "isovalue");
  const json& field = description::object_member(root, "", "field");
  return description::reader_of(isosurface_readers(), field, "field", "fields")(field, folder, isovalue);
}

namespace {

// How the file's name ends, in small letters.
std::string ending_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return ending;
}

}  // namespace

Surface load_surface(const std::filesystem::path& file) {
  const auto data = data_file_readers().find(ending_of(file));
  if (data != data_file_readers().end()) return Surface(data->second(file));
  try {
    const json root = parse(file);
    if (!root.is_object() || root.contains("kind")) return Surface(read(root, file.parent_path()));
    for (const auto& [member, reader] : data_member_readers()) {
      if (root.contains(member)) return Surface(reader(file));
    }
    return Surface(read(root, file.parent_path()));
  } catch (const Error& error) {
    // What reads data has the name of the file in front.
    const std::string message = error.what(), name = file.string();
    if (message.starts_with(name) || message.starts_with("\"" + name + "\"")) throw;
    throw Error(error.code(), fmt::format("{}: {}", name, message));
  }
}

}  // namespace smurf
