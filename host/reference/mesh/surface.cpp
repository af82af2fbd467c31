// Polygon meshes, answered by the reference.
#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/mesh/brute_force.hpp"
#include "reference/surface.hpp"
#include "reference/walk/mesh.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/mesh/definition.hpp"

namespace smurf {
namespace {

class MeshReference : public ReferenceSurface {
 public:
  explicit MeshReference(const MeshSurface& surface)
      : mesh_(surface.mesh), normals_(surface.normals), sections_(surface.mesh) {}

  bool has_coordinates() const override { return true; }

  // Ordered as they are told: by t in float, and among equals by face.
  void roots(const ReferenceRay& ray, bool, std::vector<ReferenceHit>& hits) const override {
    for (const MeshHit& hit : mesh_.hits(ray, false)) {
      hits.push_back({hit.t, 0.0, HitStatus::isolated, 0.0, 0.0, {hit.at.face, float(hit.at.u), float(hit.at.v)}});
    }
    std::stable_sort(hits.begin(), hits.end(), [](const ReferenceHit& a, const ReferenceHit& b) {
      const float ta = float(a.t), tb = float(b.t);
      return ta < tb || (ta == tb && a.coordinates.part < b.coordinates.part);
    });
  }

  ReferencePoint measure(const glm::dvec3& point, const SurfaceCoordinates* coordinates) const override {
    const bool is_finite = std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
    const bool is_nowhere = coordinates ? coordinates->part >= mesh_.face_count() : !is_finite;
    if (is_nowhere) return {std::numeric_limits<double>::quiet_NaN(), undefined_frame()};
    const MeshPoint at =
        coordinates ? MeshPoint{coordinates->part, coordinates->u, coordinates->v} : mesh_.nearest(point).at;
    return {std::numeric_limits<double>::quiet_NaN(),
            mesh_.measure(at, normals_ == MeshNormals::face),
            {at.face, float(at.u), float(at.v)},
            mesh_.location(at)};
  }

  ReferenceWalker begin_walk(const glm::dvec3& point, const SurfaceCoordinates* coordinates,
                             const glm::dvec3& direction, double tolerance) const override {
    if (coordinates && coordinates->part >= mesh_.face_count())
      return {.location = point, .status = WalkStatus::off_surface};
    const MeshPoint at =
        coordinates ? MeshPoint{coordinates->part, coordinates->u, coordinates->v} : mesh_.nearest(point).at;
    ReferenceWalker walker = walk_start(point, mesh_.location(at), normal(at), direction, tolerance);
    walker.part = at.face;
    walker.u = at.u;
    walker.v = at.v;
    return walker;
  }

  ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const override {
    const SectionEnd end = sections_.follow(section_start(from, distance), {from.part, from.u, from.v});
    return walk_end(from, end, normal({end.part, end.u, end.v}));
  }

  std::size_t bytes() const override { return mesh_.bytes() + sections_.bytes(); }
  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition&) const override { return nullptr; }

 private:
  glm::dvec3 normal(const MeshPoint& at) const {
    const glm::dvec3 n = normals_ == MeshNormals::face ? mesh_.face_normal(at.face) : mesh_.interpolated_normal(at);
    const double length = glm::length(n);
    return length > 0 ? n / length : glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  }

  ReferenceMesh mesh_;
  MeshNormals normals_;
  MeshSections sections_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_mesh(const SurfaceDefinition& definition) {
  const auto& surface = dynamic_cast<const MeshSurface&>(definition);
  return std::make_shared<MeshReference>(surface);
}

}  // namespace smurf
