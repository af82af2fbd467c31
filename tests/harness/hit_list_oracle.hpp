// The hits of another list as the truth: those of the reference, for kinds whose roots are not known otherwise.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

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

// The hits of one ray of the list.
class HitListRay : public RayOracle {
 public:
  HitListRay(const HitList& truth, const HitListRules& rules, std::size_t index, const Ray& ray)
      : rules_(rules), ray_(ray) {
    for (std::size_t i = truth.offsets()[index]; i < truth.offsets()[index + 1]; i++) {
      roots_.push_back({.t = truth.t()[i], .row = i});
      const HitStatus status = truth.status()[i];
      doubtful_ = doubtful_ || status == HitStatus::tangent || status == HitStatus::unresolved;
    }
    doubtful_ = doubtful_ && rules.doubtful_when_flagged;
    if (!rules.certain) return;
    for (std::size_t k = 0; k < roots_.size(); k++) roots_[k].certain = rules.certain(ray, roots_, k);
  }

  std::span<const Root> roots() const override { return roots_; }
  bool doubtful() const override { return doubtful_; }
  Match match(const Hit& hit, const Root& root) const override { return rules_.match(ray_, hit, root); }
  bool excused(const Hit& hit) const override { return rules_.excused && rules_.excused(ray_, hit); }
  double enclosure(const Hit& hit) const override {
    return hit.uncertainty + (rules_.rounding ? rules_.rounding(ray_) : 0);
  }

 private:
  const HitListRules& rules_;
  Ray ray_;
  std::vector<Root> roots_;
  bool doubtful_ = false;
};

class HitListOracle : public Oracle {
 public:
  HitListOracle(HitList truth, HitListRules rules) : truth_(std::move(truth)), rules_(std::move(rules)) {}

  std::unique_ptr<const RayOracle> on(std::size_t index, const Ray& ray) const override {
    return std::make_unique<HitListRay>(truth_, rules_, index, ray);
  }
  HitStatus claim() const override { return rules_.claim; }
  const char* unit() const override { return rules_.unit; }
  const HitList& truth() const { return truth_; }

 private:
  HitList truth_;
  HitListRules rules_;
};

}  // namespace smurf::test
