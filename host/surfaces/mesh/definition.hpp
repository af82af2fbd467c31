// Polygon meshes as surfaces.
#pragma once

#include <memory>
#include <vector>

#include "smurf/mesh.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class MeshSurface : public SurfaceDefinition {
 public:
  MeshSurface(const Mesh& mesh, MeshNormals normals, bool spatial_splits)
      : SurfaceDefinition(SurfaceKind::mesh), mesh(mesh), normals(normals), spatial_splits(spatial_splits) {}
  std::string_view kind() const override { return "mesh"; }
  Bounds bounds() const override { return {glm::dvec3(mesh.lower()), glm::dvec3(mesh.upper())}; }
  std::uint32_t properties() const override;
  std::vector<std::string_view> coordinate_names() const override { return {"face", "u", "v"}; }
  std::size_t parts() const override { return mesh.face_count(); }
  std::vector<Fact> facts() const override;
  std::string no_inside() const override {
    return mesh.topology().closed ? "" : "the mesh is open, so that it encloses nothing (smurf info tells its borders)";
  }
  std::string_view ray_limits() const override { return ", and its origin not 5e11 times as far out as the mesh"; }

  const Mesh mesh;
  const MeshNormals normals;
  const bool spatial_splits;
};

}  // namespace smurf
