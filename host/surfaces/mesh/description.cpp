// Polygon meshes from an API call or a description, and what is told of them.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "smurf/error.hpp"
#include "surfaces/description.hpp"
#include "surfaces/mesh/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

std::string count_text(std::uint64_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

// What was changed, of which there may be nothing.
std::string repairs_text(const MeshRepairs& r) {
  std::vector<std::string> parts;
  const auto add = [&](std::uint64_t count, std::string_view one, std::string_view many) {
    if (count > 0) parts.push_back(count_text(count, one, many));
  };
  add(r.polygons_split, "polygon split", "polygons split");
  add(r.small_faces, "face of one or two corners dropped", "faces of one or two corners dropped");
  add(r.repeated_corners, "triangle with a repeated corner dropped", "triangles with a repeated corner dropped");
  add(r.zero_area, "triangle without area dropped", "triangles without area dropped");
  add(r.welded_vertices, "vertex welded", "vertices welded");
  add(r.unreferenced_vertices, "vertex without a face", "vertices without a face");
  add(r.ignored_elements, "element that is no polygon ignored", "elements that are no polygons ignored");
  return parts.empty() ? "none" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string edges_text(const MeshTopology& t) {
  std::string text = fmt::format("{}, ", t.edges);
  text += t.boundary_edges == 0 ? std::string("none on a boundary") : fmt::format("{} on a boundary", t.boundary_edges);
  if (t.non_manifold_edges > 0) text += fmt::format(", {} of more than two triangles", t.non_manifold_edges);
  if (t.inconsistent_edges > 0) text += fmt::format(", {} inconsistently oriented", t.inconsistent_edges);
  return text;
}

std::string manifold_text(const MeshTopology& t) {
  if (t.manifold) return t.boundary_edges > 0 ? "yes, with boundary" : "yes";
  return fmt::format(
      "no: {}, {}",
      count_text(t.non_manifold_edges, "edge of more than two triangles", "edges of more than two triangles"),
      count_text(t.non_manifold_vertices, "vertex where fans meet", "vertices where fans meet"));
}

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

std::vector<Fact> MeshSurface::facts() const {
  const MeshTopology& t = mesh.topology();
  return {{"vertices", fmt::format("{}", t.vertices)},
          {"triangles", fmt::format("{}", t.faces)},
          {"edges", edges_text(t)},
          {"closed", t.closed ? "yes" : "no"},
          {"manifold", manifold_text(t)},
          {"orientation", std::string(name_of(t.orientation))},
          {"Euler characteristic", fmt::format("{}", t.euler_characteristic)},
          {"components", fmt::format("{}", t.components)},
          {"area", fmt::format("{:g}", t.area)},
          {"repairs", repairs_text(mesh.repairs())},
          {"normals", normals == MeshNormals::face ? "face" : "interpolated"},
          {"spatial splits", spatial_splits ? "yes" : "no"}};
}

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

}  // namespace smurf
