// Polygon meshes on a device: a hierarchy of boxes over blocks of triangles.
//
// Device memory: 12 bytes a triangle and 12 a vertex for the mesh, and for the hierarchy with its leaves about 26 a
// triangle (bunny00). Once properties have been asked for, 64 a vertex more; while they are made, about 120 a vertex on
// top. Once walks have been asked for, 12 a triangle.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "kernels/mesh/layout.inc"
#include "smurf/error.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/mesh/definition.hpp"
#include "surfaces/mesh/hierarchy.hpp"
#include "surfaces/mesh/neighbors.hpp"
#include "surfaces/mesh/rings.hpp"
#include "surfaces/mesh/vertices.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {
namespace {

class ResidentMesh final : public ResidentSurface {
 public:
  ResidentMesh(const MeshSurface& surface, Executor& executor, const PrepareOptions& options)
      : executor_(executor), mesh_(surface.mesh), unit_(mesh_unit(surface.mesh)) {
    const MeshHierarchy hierarchy = build_hierarchy(surface.mesh, unit_, surface.spatial_splits, options.progress);
    modules_["surface"] = kernel_source("mesh/surface.inc");
    modules_["walk"] = kernel_source("mesh/walk.inc");
    defines_["BVH_STACK"] = fmt::format("{}", std::max(64u, std::bit_ceil(unsigned(hierarchy.stack))));
    defines_["MESH_SPLITS"] = surface.spatial_splits ? "1" : "0";
    upload(executor, hierarchy.nodes, nodes_, "hierarchy of a mesh");
    upload(executor, hierarchy.triangles, triangles_, "triangles of a mesh");
    upload_corners(executor, surface.mesh);
    std::array<std::uint32_t, MESH_UNIFORM_WORDS> words{};
    const auto put = [&](int at, float value) { words[std::size_t(at)] = std::bit_cast<std::uint32_t>(value); };
    float size = 0, extent = 0;
    for (int axis = 0; axis < 3; axis++) {
      put(MESH_LOWER + axis, hierarchy.bounds.lower[axis]);
      put(MESH_UPPER + axis, hierarchy.bounds.upper[axis]);
      size = std::max({size, std::abs(hierarchy.bounds.lower[axis]), std::abs(hierarchy.bounds.upper[axis])});
      extent = std::max(extent, hierarchy.bounds.upper[axis] - hierarchy.bounds.lower[axis]);
    }
    put(MESH_UNIT, unit_);
    put(MESH_SIZE, size);
    put(MESH_EXTENT, extent);
    words[MESH_INTERPOLATED] = surface.normals == MeshNormals::interpolated ? 1 : 0;
    words[MESH_POSITIONS] = std::uint32_t(3 * surface.mesh.face_count());
    uniforms_ = TypedBuffer<std::uint32_t>(executor, words.size(), "surface uniforms");
    uniforms_.write(words);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  bool flags_hits() const override { return false; }
  BufferGroup buffers() const override {
    return {{"uniforms", uniforms_.get()}, {"nodes", nodes_.get()},     {"triangles", triangles_.get()},
            {"vertices", vertices_.get()}, {"corners", corners_.get()}, {"neighbors", neighbors_.get()}};
  }
  std::size_t bytes() const override {
    return nodes_.bytes() + triangles_.bytes() + vertices_.bytes() + corners_.bytes() + neighbors_.bytes() +
           uniforms_.bytes();
  }

  // Normals and curvature at the vertices (kernels/mesh/curvature.inc).
  void prepare_properties() override {
    if (!vertices_) vertices_ = make_vertices(executor_, mesh_, unit_);
  }
  void prepare_walks() override {
    if (!neighbors_) upload(executor_, mesh_neighbors(mesh_), neighbors_, "neighbours of a mesh's faces");
  }
  bool update(const SurfaceDefinition&) override { return false; }

 private:
  static void upload(Executor& executor, const std::vector<std::uint32_t>& words, TypedBuffer<std::uint32_t>& buffer,
                     std::string_view purpose) {
    buffer = TypedBuffer<std::uint32_t>(executor, words.size(), purpose);
    buffer.write(words);
  }

  void upload_corners(Executor& executor, const Mesh& mesh) {
    const std::size_t faces = 3 * mesh.face_count(), positions = 3 * mesh.vertex_count();
    corners_ = TypedBuffer<std::uint32_t>(executor, faces + positions, "corners of a mesh");
    executor.write(*corners_.get(), 0, mesh.faces().data(), faces * sizeof(std::uint32_t));
    std::vector<glm::vec3> places(mesh.vertices().begin(), mesh.vertices().end());
    for (glm::vec3& place : places) place *= unit_;
    executor.write(*corners_.get(), faces * sizeof(float), places.data(), positions * sizeof(float));
  }

  Executor& executor_;
  const Mesh mesh_;
  const float unit_;
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> nodes_, vertices_, triangles_, corners_, neighbors_, uniforms_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_mesh(const SurfaceDefinition& definition, Executor& executor,
                                             const PrepareOptions& options) {
  return std::make_unique<ResidentMesh>(dynamic_cast<const MeshSurface&>(definition), executor, options);
}

}  // namespace smurf
