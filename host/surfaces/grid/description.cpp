// Isosurfaces of sampled volumes from an API call or a description.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "io/description.hpp"
#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "surfaces/grid/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

constexpr std::pair<Reconstruction, std::string_view> reconstruction_names[] = {
    {Reconstruction::trilinear, "trilinear"},
    {Reconstruction::tricubic, "tricubic"},
    {Reconstruction::catmull_rom, "catmull-rom"},
};

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

std::shared_ptr<const SurfaceDefinition> read_grid_isosurface(const json& field, const std::filesystem::path& folder,
                                                              double isovalue) {
  description::only_members(field, "field", {"kind", "file", "array", "reconstruction"});
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
  const std::string array = field.contains("array") ? description::text_member(field, "field", "array") : "";
  try {
    return isosurface(load_volume(folder / file, array), isovalue, options).share();
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("member \"field.file\": {}", error.what()));
  }
}

// A volume alone is no surface.
std::shared_ptr<const SurfaceDefinition> read_volume_file(const std::filesystem::path& file) {
  const Volume volume = load_volume(file);
  throw Error(ErrorCode::input,
              fmt::format("\"{}\": a volume of {}x{}x{} samples from {:g} to {:g}; a surface of it needs an isovalue: "
                          "{{\"kind\": \"isosurface\", \"isovalue\": {:g}, \"field\": {{\"kind\": \"grid\", "
                          "\"file\": \"{}\"}}}}",
                          file.string(), volume.size().x, volume.size().y, volume.size().z, volume.minimum(),
                          volume.maximum(), (volume.minimum() + volume.maximum()) / 2, file.filename().string()));
}

}  // namespace smurf
