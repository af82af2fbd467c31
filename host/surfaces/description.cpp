// Surface descriptions (JSON): which kinds there are, and the messages when one is wrong.
//
// A reader checks its own members and throws Error (input) that names the member; load_surface puts the
// name of the file in front.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "io/description.hpp"
#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "surfaces/kinds.hpp"

namespace smurf {

using nlohmann::json;

std::string_view Surface::kind() const { return model_->kind(); }
Bounds Surface::bounds() const { return model_->bounds(); }

namespace {

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

Surface load_surface(const std::filesystem::path& file) {
  const auto data = data_file_readers().find(description::ending_of(file));
  if (data != data_file_readers().end()) return Surface(data->second(file));
  try {
    const json root = description::parse(file, "a surface description");
    if (!root.is_object() || root.contains("kind")) return Surface(read(root, file.parent_path()));
    for (const auto& [member, reader] : data_member_readers()) {
      if (root.contains(member)) return Surface(reader(file));
    }
    return Surface(read(root, file.parent_path()));
  } catch (const Error& error) {
    description::fail_in(file, error);
  }
}

}  // namespace smurf
