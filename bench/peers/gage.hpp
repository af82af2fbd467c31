// teem's gage as a peer: value, gradient, Hessian and curvatures at points, by the cubic B-spline on prefiltered data.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "smurf/volume.hpp"

namespace smurf::bench {

struct GageAnswers {
  std::vector<float> value, k1, k2, gauss, mean;
  std::vector<glm::vec3> gradient;
  std::vector<glm::mat3> hessian;
};

// Gage answers in index space here; the workload's volume has unit spacing.
class GageProbe {
 public:
  GageProbe(std::span<const float> samples, glm::ivec3 size);
  ~GageProbe();
  GageProbe(const GageProbe&) = delete;
  GageProbe& operator=(const GageProbe&) = delete;

  // On all hardware threads, one context each.
  void all_properties(std::span<const glm::vec3> points, GageAnswers& answers) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace smurf::bench
