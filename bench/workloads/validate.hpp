// Answers of a device against those of the double-precision reference, on a fixed sample of a workload's rays or
// points.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "smurf/interrogator.hpp"
#include "workloads/workloads.hpp"

namespace smurf::workloads {

// The distribution of an error over the sample.
struct Spread {
  double median = 0, p99 = 0, worst = 0;
};

// A root of the reference and one of the device are taken for the same when their t differ by less than `same_root`
// voxels; `worst_t` tells how near they really are.
inline constexpr double same_root = 0.1;

struct Verdict {
  std::size_t sampled = 0;               // rays or points
  std::size_t expected_hits = 0;         // that the reference finds on the sample
  std::size_t missed = 0;                // of these, not found, outside of what the device flagged
  std::size_t invented = 0;              // found by the device alone and not flagged
  std::size_t excused = 0;               // differences inside enclosures that are flagged tangent or unresolved
  std::optional<std::size_t> worst_ray;  // the ray (or point) with the first miss, else with the worst error
  Spread t;                              // |t - reference| in voxels
  Spread value;                          // |value - reference| relative to the volume's range
  Spread normal;                         // angle, radians
  Spread curvature;                      // |k - reference| relative to max(|k1|, |k2|), the worse of k1 and k2
};

struct Errors;  // as they are found, one entry a hit or point

// What the reference answers on the sample, and how long it took.
class ReferenceAnswers {
 public:
  // The sample is 2,048 rays (points) drawn at random, and for casts 1,024 among the rays in `hit_rays`, so that a
  // surface which fills little of the image is met often enough.
  ReferenceAnswers(const Workload& workload, const Interrogator& reference, const RayBatch& rays,
                   const std::vector<std::size_t>& hit_rays);
  ReferenceAnswers(const Workload& workload, const Interrogator& reference, const std::vector<glm::vec3>& points);

  Verdict judge(const HitList& hits) const;  // of the whole batch
  Verdict judge(const PointProperties& answers) const;
  const std::vector<std::size_t>& sample() const { return sample_; }  // indices of rays or points, ascending
  const HitList& hits() const { return hits_; }                       // all hits of the sampled rays
  const PointProperties& probed() const { return probed_; }
  double voxel() const { return voxel_; }
  double rate() const { return rate_; }  // rays or points per second, this workload on the reference

 private:
  void judge_ray(const HitList& hits, std::size_t sample, Verdict& verdict, Errors& errors) const;

  Kind kind_;
  std::uint32_t properties_;
  double voxel_, range_;
  std::vector<std::size_t> sample_;  // indices into the batch
  HitList hits_;                     // all hits of the sampled rays
  PointProperties probed_;
  double rate_ = 0;
};

}  // namespace smurf::workloads
