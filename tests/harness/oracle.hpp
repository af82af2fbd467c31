// What is known of the roots on rays by other means than a device's: the interface by which each kind of surface tells
// the judge (judge.hpp).
#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <span>

#include "smurf/interrogator.hpp"
#include "smurf/rays.hpp"
#include "workloads/pairing.hpp"

namespace smurf::test {

// A place where a ray crosses the surface. Where it is not `certain`, the crossing may be there or not: the truth
// itself cannot tell.
struct Root {
  double t;
  bool certain = true;
  std::size_t row = 0;  // where the oracle keeps more about it
};

// One hit of a list.
struct Hit {
  std::size_t index;  // in the list's columns
  double t, uncertainty;
  HitStatus status;
  SurfaceCoordinates place = {};  // of kinds that have coordinates
};

using workloads::another_root;

// How far a hit is from a root.
struct Match {
  double off = another_root;  // in parts of what is allowed: right up to 1, misplaced above
  double difference = 0;      // in the oracle's unit, as the verdict reports it
  bool grazing = false;       // right by another measure than t
};

// The roots on one ray, and what a device may make of them.
class RayOracle {
 public:
  virtual ~RayOracle() = default;

  virtual std::span<const Root> roots() const = 0;  // ascending in t
  // The number of roots is not known: nothing is asked of the hits but that they are well formed.
  virtual bool doubtful() const { return false; }
  // The root need not be found.
  virtual bool optional(const Root& root) const { return !root.certain; }
  // A hit that claims a root, against one of the roots.
  virtual Match match(const Hit& hit, const Root& root) const = 0;
  // A hit that may be there without a root.
  virtual bool excused(const Hit& /*hit*/) const { return false; }
  // The half width in t within which a flagged hit accounts for roots.
  virtual double enclosure(const Hit& hit) const { return hit.uncertainty; }
  // What enclosures are compared with: the length in t that is asked about.
  virtual double length() const { return HUGE_VAL; }
};

// The roots on the rays of one batch.
class Oracle {
 public:
  virtual ~Oracle() = default;

  virtual std::unique_ptr<const RayOracle> on(std::size_t index, const Ray& ray) const = 0;
  // The status of hits that claim exactly one root. Flagged are those that are tangent or unresolved.
  virtual HitStatus claim() const { return HitStatus::isolated; }
  // Hits that are `sampled` or `bracketed` claim one root, too.
  virtual bool may_sample() const { return false; }
  // What differences of t are told in.
  virtual const char* unit() const { return "of what is allowed"; }
};

}  // namespace smurf::test
