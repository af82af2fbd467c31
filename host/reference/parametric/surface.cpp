// Surfaces s(u, v), answered by the reference: expressions as they are written, patches by basis functions on their
// knots. Nothing of the pieces, leaves and borders that devices work with is used here.
#include <cmath>
#include <limits>

#include "reference/parametric/crossings.hpp"
#include "reference/parametric/properties.hpp"
#include "reference/surface.hpp"
#include "reference/walk/parametric_charts.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/parametric/definition.hpp"

namespace smurf {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

class ParametricReference : public ReferenceSurface {
 public:
  explicit ParametricReference(const ParametricSurface& surface)
      : facets_(reference_facets(surface)),
        cells_(facets_),
        extent_(extent_of(surface.bounds())),
        borders_(facets_, surface, extent_),
        crossings_(facets_, cells_, borders_, extent_),
        properties_(facets_, cells_, borders_, extent_),
        charts_(facets_, borders_, extent_) {}

  bool has_coordinates() const override { return true; }

  void roots(const ReferenceRay& ray, bool, std::vector<ReferenceHit>& hits) const override {
    for (const ParametricCrossing& c : crossings_.find(ray.origin, ray.direction, ray.t_min, ray.t_max)) {
      hits.push_back({c.t, c.uncertainty, c.status, c.slope, 0.0, {facets_[c.facet]->part, float(c.u), float(c.v)}});
    }
  }

  ReferencePoint measure(const glm::dvec3& point, const SurfaceCoordinates* coordinates) const override {
    ParametricPlace place;
    const bool found = coordinates ? properties_.locate(coordinates->part, coordinates->u, coordinates->v, place)
                                   : properties_.nearest(point, place);
    if (!found) return {nan, undefined_frame()};
    const SurfaceFrame frame = properties_.measure(place);
    return {nan,
            frame,
            {facets_[place.facet]->part, float(place.u), float(place.v)},
            facets_[place.facet]->at(place.u, place.v, 0).s};
  }

  ReferenceWalker begin_walk(const glm::dvec3& point, const SurfaceCoordinates* coordinates,
                             const glm::dvec3& direction, double tolerance) const override {
    ParametricPlace place;
    const bool found = coordinates ? properties_.locate(coordinates->part, coordinates->u, coordinates->v, place)
                                   : properties_.nearest(point, place);
    if (!found) return {.location = point, .status = WalkStatus::off_surface};
    const glm::dvec3 normal = properties_.measure(place).normal;
    ReferenceWalker walker =
        walk_start(point, facets_[place.facet]->at(place.u, place.v, 0).s, normal, direction, tolerance);
    walker.part = facets_[place.facet]->part;
    walker.u = place.u;
    walker.v = place.v;
    return walker;
  }

  ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const override {
    ParametricPlace place;
    if (!properties_.locate(from.part, from.u, from.v, place))
      return {.location = from.location, .status = WalkStatus::undefined};
    SectionEnd end = follow_section(charts_, section_start(from, distance), {place.facet, {place.u, place.v}});
    place = {end.part, end.u, end.v};
    end.part = facets_[place.facet]->part;
    return walk_end(from, end, properties_.measure(place).normal);
  }

  std::size_t bytes() const override { return cells_.bytes() + facets_.size() * sizeof(ReferenceFacet); }
  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition&) const override { return nullptr; }

 private:
  static double extent_of(const Bounds& bounds) {
    const glm::dvec3 size = bounds.upper - bounds.lower;
    return std::max({size.x, size.y, size.z});
  }

  std::vector<std::unique_ptr<ReferenceFacet>> facets_;
  ReferenceCells cells_;
  double extent_;
  ReferenceBorders borders_;
  ReferenceCrossings crossings_;
  ReferenceProperties properties_;
  ParametricCharts charts_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_parametric(const SurfaceDefinition& definition) {
  return std::make_shared<ParametricReference>(dynamic_cast<const ParametricSurface&>(definition));
}

}  // namespace smurf
