// The isosurface of a sampled volume, answered by the reference.
#include "surfaces/grid/definition.hpp"
#include "surfaces/kinds.hpp"

#include <limits>

#include "reference/grid/field.hpp"
#include "reference/grid/roots.hpp"
#include "reference/surface.hpp"
#include "reference/walk/level_set.hpp"

namespace smurf {
namespace {

constexpr int out_of_denser_side = -1;
// Curvatures that differ by less than this part of an inverse cell edge are those of a plane.
constexpr double flat = 1e-9;

class GridReference : public ReferenceSurface {
 public:
  GridReference(const Volume& volume, Reconstruction reconstruction, double isovalue,
                std::shared_ptr<const GridField> field)
      : volume_(volume), reconstruction_(reconstruction), roots_(std::move(field), isovalue) {}

  void roots(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const override {
    roots_.find(ray, first_only, hits);
  }

  ReferencePoint measure(const glm::dvec3& point, const SurfaceCoordinates*) const override {
    const GridField& field = *roots_.field();
    if (const auto jet = field.jet(point)) {
      return {jet->value,
              level_set_frame(jet->gradient, jet->hessian, out_of_denser_side, flat / field.shortest_step())};
    }
    return {field.value(point).value_or(std::numeric_limits<double>::quiet_NaN()), undefined_frame()};
  }

  ReferenceWalker begin_walk(const glm::dvec3& point, const SurfaceCoordinates*, const glm::dvec3& direction,
                             double tolerance) const override {
    return smurf::begin_walk(level_set(), *this, point, direction, tolerance);
  }

  ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const override {
    return step_of_walk(level_set(), *this, from, distance);
  }

  std::size_t bytes() const override { return roots_.field()->bytes(); }

  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition& model) const override {
    const auto* other = dynamic_cast<const GridIsosurface*>(&model);
    if (!other || other->volume.samples() != volume_.samples() || other->volume.type() != volume_.type() ||
        other->volume.size() != volume_.size() || other->volume.placement().axes != volume_.placement().axes ||
        other->volume.placement().origin != volume_.placement().origin || other->reconstruction != reconstruction_) {
      return nullptr;
    }
    return std::make_shared<GridReference>(other->volume, reconstruction_, other->isovalue, roots_.field());
  }

 private:
  LevelSet level_set() const {
    const GridField& field = *roots_.field();
    return {
        [&field, level = roots_.isovalue()](const glm::dvec3& p) -> std::optional<double> {
          const glm::dvec3 index = field.to_index(p), last(field.size() - 1);
          constexpr double outside = 1e-6;  // of a cell: the field's own allowance
          if (glm::any(glm::lessThan(index, glm::dvec3(-outside))) || glm::any(glm::greaterThan(index, last + outside)))
            return std::nullopt;
          return field.value(p).value_or(std::numeric_limits<double>::quiet_NaN()) - level;
        },
        0.25 * field.shortest_step()};
  }

  Volume volume_;  // kept, so that another volume cannot take its address
  Reconstruction reconstruction_;
  RayRoots roots_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_grid(const SurfaceDefinition& definition) {
  const auto& surface = dynamic_cast<const GridIsosurface&>(definition);
  return std::make_shared<GridReference>(surface.volume, surface.reconstruction, surface.isovalue,
                                         std::make_shared<GridField>(surface.volume, surface.reconstruction));
}

}  // namespace smurf
