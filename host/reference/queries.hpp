// Interrogation by the double-precision reference: plain loops over rays and points, on all cores.
//
// Locations, t and properties are computed in double and rounded to float at the end. Properties are those of the
// stored (float) locations, so that they do not depend on when they are asked for.
#pragma once

#include <memory>

#include "reference/surface.hpp"
#include "surfaces/queries.hpp"

namespace smurf {

class ReferenceQueries : public SurfaceQueries {
 public:
  explicit ReferenceQueries(std::shared_ptr<const ReferenceSurface> surface) : surface_(std::move(surface)) {}

  void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) override;
  void measure(const PointSet& points, std::uint32_t wanted, const ProbeOptions& options,
               PointProperties& out) override;
  void walk(const WalkStart& start, const WalkOptions& options, const WalkSink& sink) override;
  void update(const std::shared_ptr<const SurfaceDefinition>& model) override;
  std::size_t device_bytes() const override { return surface_->bytes(); }

  const ReferenceSurface& surface() const { return *surface_; }

 private:
  std::shared_ptr<const ReferenceSurface> surface_;
};

// What is wrong with a ray, as words for a message; null for a valid one.
const char* fault_of(const Ray& ray);

}  // namespace smurf
