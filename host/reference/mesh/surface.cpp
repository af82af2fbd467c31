// Polygon meshes, answered by the reference.
#include <algorithm>
#include <cmath>

#include "reference/mesh/brute_force.hpp"
#include "reference/surface.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/mesh/definition.hpp"

namespace smurf {
namespace {

class MeshReference : public ReferenceSurface {
 public:
  explicit MeshReference(const MeshSurface& surface) : mesh_(surface.mesh), normals_(surface.normals) {}

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

  std::size_t bytes() const override { return mesh_.bytes(); }
  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition&) const override { return nullptr; }

 private:
  ReferenceMesh mesh_;
  MeshNormals normals_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_mesh(const SurfaceDefinition& definition) {
  const auto& surface = dynamic_cast<const MeshSurface&>(definition);
  return std::make_shared<MeshReference>(surface);
}

}  // namespace smurf
