// Cases of stream surfaces with closed forms (truth/stream/scenes.hpp): hits with their u and τ, and what is measured
// there.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "harness/case.hpp"
#include "harness/parametric_case.hpp"
#include "truth/stream/scenes.hpp"

namespace smurf::test {

// Hits against all roots of a scene. `place`: how far they may be off across the surface, of the extent.
class StreamOracle : public Oracle {
 public:
  StreamOracle(const StreamScene& scene, const RayBatch& rays, double place);

  std::unique_ptr<const RayOracle> on(std::size_t index, const Ray& ray) const override;
  const char* unit() const override { return "of the extent"; }
  bool may_sample() const override { return true; }

 private:
  friend class StreamRay;
  StreamScene scene_;
  ParametricScene parametric_;
  double extent_, place_;
  std::vector<ParametricRoots> roots_;
};

double extent_of(const StreamScene& scene);
// Chords and cameras, and of hostile ones those that floats can be asked for: borders, corners, windows of t, axes.
std::vector<RayFamily> stream_rays(const StreamScene& scene, std::size_t random, std::size_t hostile, unsigned seed);
RayBatch chords_of(const Bounds& box, std::size_t count);  // through random points of a box, from outside
Case case_of(const StreamScene& scene, const StreamOptions& options, double place);
// What is measured at hits against the scene's derivatives at their own u and τ.
void expect_stream_properties(const StreamScene& scene, const Case& one, const HitList& hits, const std::string& where);
// Hits of one ray at one t are at places of their own.
void expect_distinct(const StreamScene& scene, const HitList& hits, const std::string& where);

}  // namespace smurf::test
