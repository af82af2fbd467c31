// Judging a hit list by the truth: counts first, then t.
//
// An isolated hit claims exactly one root; so the isolated hits of a ray must pair with its roots in order, each within
// tolerance. Roots left over must lie in the enclosure of a flagged hit (tangent or unresolved), be uncertain even in
// double precision, or lie within rounding of an end of the ray's range or of the domain, where they may be found or
// not. Isolated hits left over are inventions.
//
// A pair is within tolerance when the two are close in voxels along the ray, or (where the ray grazes the surface and
// no float can say t so well) when the exact field at the hit differs from the isovalue by rounding alone.
#pragma once

#include <string>

#include "harness/truth.hpp"
#include "smurf/interrogator.hpp"

namespace smurf::test {

struct Verdict {
  std::size_t rays = 0, roots = 0, hits = 0;
  std::size_t flagged_rays = 0;  // with a hit that is not isolated
  std::size_t missed = 0, invented = 0, misplaced = 0, malformed = 0;
  double largest_difference = 0;  // of t, in voxels, over the pairs that are not judged by the field's value
  std::size_t grazing = 0;        // pairs judged by the field's value
  // The worst offender: the ray and what is wrong with it.
  std::size_t worst_ray = 0;
  double worst_severity = 0;
  std::string worst;

  std::size_t failures() const { return missed + invented + misplaced + malformed; }
  void add(const Verdict& other);
  std::string summary() const;
};

struct Judging {
  double t_tolerance;      // voxels
  double value_tolerance;  // of the field
  double border = 1e-4;    // voxels: roots this close to an end of the range may be found or not
};

Verdict judge(const HitList& hits, const Truth& truth, const GridField& field, double isovalue, const RayBatch& rays,
              const Judging& judging);

}  // namespace smurf::test
