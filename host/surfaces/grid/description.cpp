// Isosurfaces: from an API call or a description, over any kind of scalar field.
//
// A field kind is a line in field_readers(): it makes the surface f = isovalue of the field that it reads.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "surfaces/description.hpp"
#include "surfaces/grid/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

constexpr std::pair<Reconstruction, std::string_view> reconstruction_names[] = {
    {Reconstruction::trilinear, "trilinear"},
    {Reconstruction::tricubic, "tricubic"},
    {Reconstruction::catmull_rom, "catmull-rom"},
};

using FieldReader = std::function<std::shared_ptr<const SurfaceDefinition>(
    const json& field, const std::filesystem::path& folder, double isovalue)>;

std::shared_ptr<const SurfaceDefinition> read_grid(const json& field, const std::filesystem::path& folder,
                                                   double isovalue) {
  description::only_members(field, "field", {"kind", "file", "reconstruction"});
  GridOptions options;
  if (field.contains("reconstruction")) {
    const std::string name = description::text_member(field, "field", "reconstruction");
    try {
      options.reconstruction = reconstruction_named(name);
    } catch (const Error& error) {
      throw Error(error.code(), fmt::format("member \"field.reconstruction\": {}", error.what()));
    }
  }
  const std::string file = description::text_member(field, "field", "file");
  try {
    return isosurface(load_volume(folder / file), isovalue, options).share();
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("member \"field.file\": {}", error.what()));
  }
}

const std::map<std::string, FieldReader>& field_readers() {
  static const std::map<std::string, FieldReader> readers{
      {"expression", read_expression_isosurface},
      {"grid", read_grid},
  };
  return readers;
}

}  // namespace

std::string_view name_of(Reconstruction reconstruction) {
  for (const auto& [value, name] : reconstruction_names) {
    if (value == reconstruction) return name;
  }
  throw Error(ErrorCode::usage, "not a reconstruction");
}

Reconstruction reconstruction_named(std::string_view name) {
  std::vector<std::string_view> known;
  for (const auto& [value, known_name] : reconstruction_names) {
    if (known_name == name) return value;
    known.push_back(known_name);
  }
  throw Error(ErrorCode::input,
              fmt::format("\"{}\" is no known reconstruction; known are {}", name, fmt::join(known, ", ")));
}

Surface isosurface(const Volume& volume, double isovalue, const GridOptions& options) {
  if (!std::isfinite(isovalue))
    throw Error(ErrorCode::input, fmt::format("the isovalue must be a finite number, not {}", isovalue));
  return Surface(std::make_shared<const GridIsosurface>(volume, isovalue, options));
}

std::shared_ptr<const SurfaceDefinition> read_isosurface(const json& root, const std::filesystem::path& folder) {
  description::only_members(root, "", {"kind", "isovalue", "field"});
  const double isovalue = description::number_member(root, "", "isovalue");
  const json& field = description::object_member(root, "", "field");
  return description::reader_of(field_readers(), field, "field", "fields")(field, folder, isovalue);
}

}  // namespace smurf
