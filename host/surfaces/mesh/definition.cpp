#include "surfaces/mesh/definition.hpp"

#include <fmt/format.h>

namespace smurf {
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

}  // namespace

std::uint32_t MeshSurface::properties() const {
  return Property::parameters | Property::location | Property::normal | Property::gauss | Property::mean |
         Property::principal | Property::directions | Property::normal_curvature | Property::distance |
         Property::inside;
}

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

}  // namespace smurf
