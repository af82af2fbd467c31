// What the public API asks of a surface on a device. Two implementations: the batched stages on an
// executor (host/api/device_interrogation.cpp) and the double-precision reference (host/reference).
#pragma once

#include <memory>

#include "smurf/interrogator.hpp"

namespace smurf {

class Interrogation {
 public:
  virtual ~Interrogation() = default;
  // Fills everything of the hit list but its interrogation_.
  virtual void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) = 0;
  // Adds the columns in `wanted` to `out`, and the status. `directions` is empty or one per point.
  virtual void measure(std::span<const glm::vec3> points, std::span<const glm::vec3> directions, std::uint32_t wanted,
                       const ProbeOptions& options, PointProperties& out) = 0;
  virtual void update(const std::shared_ptr<const SurfaceModel>& model) = 0;
  virtual std::size_t device_bytes() const = 0;
};

std::unique_ptr<Interrogation> interrogate_on_device(const Device& device,
                                                     const std::shared_ptr<const SurfaceModel>& model);

}  // namespace smurf
