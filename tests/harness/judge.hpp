// Judging a hit list by an oracle, for surfaces of every kind: counts first, then t. What is measured at hits is judged
// by points.hpp.
//
// A hit that claims a root claims exactly one; so the claiming hits of a ray must pair with its roots in order, each as
// the oracle allows. Roots left over are missed, unless they lie in the enclosure of a flagged hit (tangent or
// unresolved) or the oracle lets them be found or not. Hits left over are invented, or doubled where their root has
// another hit, unless the oracle excuses them. Of all ways to pair them the one with the fewest errors counts.
#pragma once

#include <string>

#include "harness/oracle.hpp"
#include "smurf/interrogator.hpp"

namespace smurf::test {

struct Verdict {
  std::size_t rays = 0, roots = 0, hits = 0;
  std::size_t flagged_rays = 0;   // with a hit that is tangent or unresolved
  std::size_t sampled_rays = 0;   // with a hit that is `sampled`
  std::size_t doubtful_rays = 0;  // whose number of roots the oracle does not know
  std::size_t missed = 0, invented = 0, doubled = 0, misplaced = 0, malformed = 0;
  std::size_t optional_roots = 0, optional_missed = 0;  // roots that need not be found
  std::size_t excused = 0;                              // hits that may be there without a root
  std::size_t uneven = 0;                               // pairs whose t differ at all
  double largest_difference = 0;  // of t, in the oracle's unit, over the pairs that are not grazing
  double widest_enclosure = 0;    // of flagged hits, in parts of the length that is asked about
  std::size_t grazing = 0;        // pairs judged by another measure than t
  std::string unit;
  // The worst offender: the ray and what is wrong with it.
  std::size_t worst_ray = 0;
  double worst_severity = 0;
  std::string worst;

  std::size_t failures() const { return missed + invented + doubled + misplaced + malformed; }
  void add(const Verdict& other);
  std::string summary() const;
};

// Of the rays of `hits`, which are the first of the oracle's.
Verdict judge(const HitList& hits, const Oracle& oracle, const RayBatch& rays);
// Of one ray.
Verdict judge_ray(const HitList& hits, std::size_t index, const RayOracle& oracle, const Ray& ray,
                  HitStatus claim = HitStatus::isolated, bool may_sample = false);

// The first hits are the first of all hits.
void expect_first(const HitList& all, const HitList& first, const std::string& where);

// Every column of two hit lists, to the bit.
bool same_bytes(const HitList& a, const HitList& b);

}  // namespace smurf::test
