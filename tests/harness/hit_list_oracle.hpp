// The hits of another list as the truth: those of the reference, for kinds whose roots are not known otherwise.
#pragma once

#include <functional>
#include <span>
#include <utility>

#include "harness/oracle.hpp"

namespace smurf::test {

// How a kind holds hits against the other list's. `truth` is that list; roots carry their rows in it.
struct HitListRules {
  std::function<Match(const Ray& ray, const Hit& hit, const Root& root)> match;
  // Whether root k of the ray's roots must be found; all where it is empty.
  std::function<bool(const Ray& ray, std::span<const Root> roots, std::size_t k)> certain = {};
  // Whether a hit without a root may be there; none where it is empty.
  std::function<bool(const Ray& ray, const Hit& hit)> excused = {};
  // What rounding adds to the enclosures of flagged hits; nothing where it is empty.
  std::function<double(const Ray& ray)> rounding = {};
  HitStatus claim = HitStatus::isolated;
  // Rays on which the truth itself flags a hit are doubtful.
  bool doubtful_when_flagged = true;
  const char* unit = "of what is allowed";
};

class HitListOracle : public Oracle {
 public:
  HitListOracle(HitList truth, HitListRules rules) : truth_(std::move(truth)), rules_(std::move(rules)) {}

  std::unique_ptr<const RayOracle> on(std::size_t index, const Ray& ray) const override;
  HitStatus claim() const override { return rules_.claim; }
  const char* unit() const override { return rules_.unit; }
  const HitList& truth() const { return truth_; }

 private:
  HitList truth_;
  HitListRules rules_;
};

}  // namespace smurf::test
