// What the public API asks of a surface on a device. Two implementations: the batched stages on an executor, and the
// double-precision reference.
#pragma once

#include <memory>

#include "smurf/interrogator.hpp"

namespace smurf {

// Points that properties are asked of. On kinds with surface coordinates these say where a point lies; where they are
// not given, it is the point of the surface that is nearest to the location.
struct PointSet {
  std::span<const glm::vec3> locations;
  std::span<const SurfaceCoordinates> coordinates = {};  // none, or one per point
  std::span<const glm::vec3> directions = {};            // none, or one per point: for normal curvature
};

// Where a walk begins, and how far each step goes.
struct WalkStart {
  PointSet points;                   // with a direction each; with coordinates they are on the surface
  std::span<const float> distances;  // one for all, or one per point
  int steps = 1;
  bool tell_start = true;  // step 0, too
};

// Points first .. first + status.size() - 1 after a step; 0 is the start.
struct WalkedPoints {
  std::size_t first = 0;
  int step = 0;
  std::span<const glm::vec3> locations, normals, directions;
  std::span<const SurfaceCoordinates> coordinates;  // of kinds that have them, else without a meaning
  std::span<const float> chords;
  std::span<const WalkStatus> status;
};
// Takes points in tiles: all steps of one tile, in order, and then the next one's.
using WalkSink = std::function<void(const WalkedPoints&)>;

class SurfaceQueries {
 public:
  virtual ~SurfaceQueries() = default;
  // Fills everything of the hit list but its queries_.
  virtual void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) = 0;
  // Adds the columns in `wanted` to `out`, and the status.
  virtual void measure(const PointSet& points, std::uint32_t wanted, const ProbeOptions& options,
                       PointProperties& out) = 0;
  // All steps of all points; those of paths that have ended are told again, as they ended. The options' tolerance is a
  // length, and numbers are checked by the caller.
  virtual void walk(const WalkStart& start, const WalkOptions& options, const WalkSink& sink) = 0;
  virtual void update(const std::shared_ptr<const SurfaceDefinition>& definition) = 0;
  virtual std::size_t device_bytes() const = 0;
};

// Whether a cast tells numbers alone and keeps no rows.
constexpr bool only_counts(Hits hits) { return hits == Hits::any || hits == Hits::count; }

// The last stage of such a cast: rays on which hits are flagged are cast again for all hits, so that what is told is
// what Hits::all has on them. They are few, as a rule.
void count_flagged_rays(SurfaceQueries& queries, const RayBatch& rays, const CastOptions& options, HitList& hits);

// By the stages of a batch on the device's executor (host/api/batches.cpp).
std::unique_ptr<SurfaceQueries> interrogate_on_device(const Device& device,
                                                      const std::shared_ptr<const SurfaceDefinition>& definition,
                                                      const PrepareOptions& options = {});

// By the double-precision reference (host/reference/queries.cpp).
std::unique_ptr<SurfaceQueries> interrogate_by_reference(const SurfaceDefinition& definition);

}  // namespace smurf
