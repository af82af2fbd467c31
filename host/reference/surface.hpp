// What a surface kind provides to be answered by the reference: all roots along a ray, and the
// properties of a point, both in double precision. One file per kind implements it.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "reference/curvature.hpp"
#include "smurf/interrogator.hpp"

namespace smurf {

class SurfaceDefinition;

struct ReferenceRay {
  glm::dvec3 origin{0.0};
  glm::dvec3 direction{0.0, 0.0, 1.0};
  double t_min = 0;
  double t_max = std::numeric_limits<double>::infinity();
};

struct ReferenceHit {
  double t;
  double uncertainty;  // all roots that the hit stands for lie in t ± uncertainty
  HitStatus status;
  double slope;  // df/dt at t
  // Least |f - isovalue| / scale at the extrema along the ray next to the hit, as far as they were looked at.
  double margin;
  SurfaceCoordinates coordinates = {};  // for kinds that have them
};

struct ReferencePoint {
  double value;  // NaN where undefined, and for kinds without a field
  SurfaceFrame frame;
  SurfaceCoordinates coordinates = {};                            // of kinds that have them
  glm::dvec3 location{std::numeric_limits<double>::quiet_NaN()};  // of the surface point, of kinds with coordinates
};

// A point of the surface on its walk (smurf/walk.hpp); nothing is rounded between steps.
struct ReferenceWalker {
  glm::dvec3 location{0.0};
  glm::dvec3 normal{0.0};     // unit
  glm::dvec3 direction{0.0};  // unit, perpendicular to the normal
  std::uint32_t part = 0;     // surface coordinates, of kinds that have them
  double u = 0, v = 0;
  double chord = 0;
  WalkStatus status = WalkStatus::start;
};

class ReferenceSurface {
 public:
  virtual ~ReferenceSurface() = default;
  // Appends the hits in [t_min, t_max] in ascending order; with `first_only` at least the first of them.
  virtual void roots(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const = 0;
  virtual bool has_coordinates() const { return false; }
  // At the coordinates, where the kind has them and they are known; else at the point, or the point of the surface
  // nearest to it.
  virtual ReferencePoint measure(const glm::dvec3& point, const SurfaceCoordinates* coordinates = nullptr) const = 0;
  // The start of a walk: the point, or of kinds with coordinates that are known the place that they say, moved onto the
  // surface if it is within `tolerance` of it; with its normal there and the direction, projected and normalised. The
  // status says what is wrong, else `start`. Throws Error (usage) for kinds without a reference walk.
  virtual ReferenceWalker begin_walk(const glm::dvec3& point, const SurfaceCoordinates* coordinates,
                                     const glm::dvec3& direction, double tolerance) const;
  // A step further, from a point that goes on. Throws as begin_walk.
  virtual ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const;
  virtual std::size_t bytes() const = 0;
  // Another surface that shares what this one has computed, or null when they have nothing in common.
  virtual std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition& model) const = 0;
};

}  // namespace smurf
