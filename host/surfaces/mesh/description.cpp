// Polygon meshes from an API call or a description.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "io/description.hpp"
#include "smurf/error.hpp"
#include "surfaces/mesh/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

// False where it is not given.
bool flag(const json& root, const std::string& name) {
  const auto member = root.find(name);
  if (member == root.end()) return false;
  if (!member->is_boolean())
    throw Error(ErrorCode::input,
                fmt::format("member \"{}\" must be true or false, not {}", name, description::shown(*member)));
  return member->get<bool>();
}

MeshNormals normals_named(const std::string& name) {
  if (name == "face") return MeshNormals::face;
  if (name == "interpolated") return MeshNormals::interpolated;
  throw Error(ErrorCode::input, fmt::format("member \"normals\" is \"{}\"; known are face, interpolated", name));
}

}  // namespace

Surface mesh_surface(const Mesh& mesh, MeshNormals normals, bool spatial_splits) {
  return Surface(std::make_shared<const MeshSurface>(mesh, normals, spatial_splits));
}

std::shared_ptr<const SurfaceDefinition> read_mesh(const json& root, const std::filesystem::path& folder) {
  description::only_members(root, "", {"kind", "file", "weld", "normals", "spatial_splits"});
  MeshOptions options;
  options.weld = flag(root, "weld");
  const bool spatial_splits = flag(root, "spatial_splits");
  const MeshNormals normals =
      root.contains("normals") ? normals_named(description::text_member(root, "", "normals")) : MeshNormals::face;
  const std::string file = description::text_member(root, "", "file");
  try {
    return mesh_surface(load_mesh(folder / file, options), normals, spatial_splits).share();
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("member \"file\": {}", error.what()));
  }
}

std::shared_ptr<const SurfaceDefinition> read_mesh_file(const std::filesystem::path& file) {
  return mesh_surface(load_mesh(file)).share();
}

}  // namespace smurf
