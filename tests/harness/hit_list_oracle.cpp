#include "harness/hit_list_oracle.hpp"

#include <vector>

namespace smurf::test {
namespace {

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

}  // namespace

std::unique_ptr<const RayOracle> HitListOracle::on(std::size_t index, const Ray& ray) const {
  return std::make_unique<HitListRay>(truth_, rules_, index, ray);
}

}  // namespace smurf::test
