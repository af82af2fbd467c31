// Resolves in double precision the hits that a device flagged.
//
// A device finds all hits in floats and flags those that rounding leaves open, as tangent or unresolved, with an
// enclosure. On surfaces whose terms cancel these can be many. Of each ray with such a hit the enclosures are handed to
// the surface's RootResolver, which may prove that there is no root, exactly one, or several; what is still open stays
// flagged, with the enclosure narrowed.
//
// Enclosures that come within rounding of each other, those of isolated hits among them, are resolved as one stretch,
// whose roots take the place of all of its hits: so no root near a common end is lost or told twice.
//
// The cost is borne by flagged hits alone, but for one look at the column of statuses. Results do not depend on
// scheduling.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "surfaces/hit_columns.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class FlaggedHitResolver {
 public:
  // Finds hits on a device; flagged ones stay.
  using Cast = std::function<void(const RayBatch& rays, HitList& hits)>;

  // Where a first hit is proved to be no root, its ray is cast again from there on by `cast_first`, until the hit that
  // it has is one or the ray ends.
  static void resolve(const SurfaceDefinition& model, const RayBatch& rays, Hits wanted, const Cast& cast_first,
                      HitList& hits);

 private:
  struct Hit {
    float t, uncertainty;
    HitStatus status;
    SurfaceCoordinates coordinates;
  };
  struct RayHits {
    std::size_t ray;
    std::vector<Hit> hits;
    std::optional<float> again;  // no hit up to here: the ray must be cast again
  };

  static Hit hit_at(const HitList& hits, std::size_t row);
  static std::vector<RayHits> flagged_rays(const HitList& hits);
  static void resolve_ray(const RootResolver& resolver, const Bounds& bounds, const Ray& ray, Hits wanted,
                          RayHits& ray_hits);
  static void cast_again(const RootResolver& resolver, const Bounds& bounds, const RayBatch& rays,
                         const Cast& cast_first, std::vector<RayHits>& all);
  static void write(const std::vector<RayHits>& changed, const RayBatch& rays, bool coordinates, HitList& hits);
};

}  // namespace smurf
