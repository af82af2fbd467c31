// Polygon meshes as surfaces; the host description is shared by the device side (mesh.cpp) and the reference
// (host/reference/mesh/surface.cpp).
#pragma once

#include <memory>
#include <vector>

#include "smurf/mesh.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class MeshSurface : public SurfaceDefinition {
 public:
  MeshSurface(const Mesh& mesh, MeshNormals normals, bool spatial_splits)
      : mesh(mesh), normals(normals), spatial_splits(spatial_splits) {}
  std::string_view kind() const override { return "mesh"; }
  Bounds bounds() const override { return {glm::dvec3(mesh.lower()), glm::dvec3(mesh.upper())}; }
  std::uint32_t properties() const override;
  bool has_coordinates() const override { return true; }
  std::vector<Fact> facts() const override;
  std::unique_ptr<ResidentSurface> reside(Executor& executor, const PrepareOptions& options) const override;
  std::unique_ptr<SurfaceQueries> reference() const override;  // host/reference/mesh/surface.cpp

  const Mesh mesh;
  const MeshNormals normals;
  const bool spatial_splits;
};

}  // namespace smurf
