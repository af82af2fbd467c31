#include "harness/judge.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "harness/tolerances.hpp"
#include "numerics/parallel.hpp"

namespace smurf::test {
namespace {

// Kinds of failure in order of severity; differences of t come below 1.
constexpr double malformed_severity = 4, missed_severity = 3, invented_severity = 2;

class RayJudge {
 public:
  RayJudge(const HitList& hits, std::size_t index, const RayOracle& oracle, const Ray& ray, HitStatus claim,
           bool may_sample)
      : hits_(hits),
        index_(index),
        oracle_(oracle),
        ray_(ray),
        claim_(claim),
        may_sample_(may_sample),
        roots_(oracle.roots()) {
    for (std::size_t i = hits.offsets()[index]; i < hits.offsets()[index + 1]; i++) {
      list_.push_back({i, hits.t()[i], hits.uncertainty()[i], hits.status()[i]});
      if (!hits.coordinates().empty()) list_.back().place = hits.coordinates()[i];
    }
  }

  Verdict verdict() {
    verdict_.rays = 1;
    verdict_.roots = roots_.size();
    verdict_.hits = list_.size();
    if (hits_.ray_status()[index_] != RayStatus::ok) {
      fail(verdict_.malformed, malformed_severity, "the ray is called invalid");
    } else if (well_formed()) {
      note_flagged();
      if (oracle_.doubtful()) verdict_.doubtful_rays = 1;
      else pair();
    }
    if (verdict_.failures() > 0) verdict_.worst += "; " + told();
    return verdict_;
  }

 private:
  bool well_formed() {
    for (std::size_t i = 0; i < list_.size(); i++) {
      const Hit& hit = list_[i];
      std::string wrong;
      if (!(hit.t >= ray_.t_min && hit.t <= ray_.t_max))
        wrong = fmt::format("t = {} is outside of the range asked for", hit.t);
      if (i > 0 && hit.t < list_[i - 1].t) wrong = fmt::format("t = {} comes after {}", hit.t, list_[i - 1].t);
      if (!(hit.uncertainty >= 0)) wrong = fmt::format("the uncertainty is {}", hit.uncertainty);
      if (hits_.rays()[hit.index] != index_)
        wrong = fmt::format("the hit says that it is of ray {}", hits_.rays()[hit.index]);
      const bool sampled = may_sample_ && hit.status == HitStatus::sampled;
      if (sampled) verdict_.sampled_rays = 1;
      const bool bracketed = may_sample_ && hit.status == HitStatus::bracketed;
      if (hit.status != claim_ && !sampled && !bracketed && !is_flagged(hit))
        wrong = fmt::format("its status is {}", name_of(hit.status));
      const auto [off, allowed] = location_error(hit);
      if (!(off <= allowed)) wrong = fmt::format("its location is off by {:.3g}", off);
      if (wrong.empty()) continue;
      fail(verdict_.malformed, malformed_severity, fmt::format("hit {}: {}", i, wrong));
      return false;
    }
    return true;
  }

  // The location is origin + t·direction up to rounding.
  std::pair<double, double> location_error(const Hit& hit) const {
    constexpr double roundings = tolerance(Quantity::location, any_kind).value;
    const glm::dvec3 origin(ray_.origin), direction(ray_.direction), place(hits_.locations()[hit.index]);
    const double size = glm::length(origin) + std::abs(hit.t) * glm::length(direction);
    return {glm::length(origin + hit.t * direction - place), roundings * 0x1p-24 * size};
  }

  static bool is_flagged(const Hit& hit) {
    return hit.status == HitStatus::tangent || hit.status == HitStatus::unresolved;
  }

  void note_flagged() {
    for (const Hit& hit : list_) {
      if (!is_flagged(hit)) {
        claims_.push_back(hit);
        continue;
      }
      verdict_.flagged_rays = 1;
      verdict_.widest_enclosure = std::max(verdict_.widest_enclosure, 2 * hit.uncertainty / oracle_.length());
    }
  }

  // Roots within a flagged hit's enclosure are accounted for.
  bool enclosed(const Root& root) const {
    return std::ranges::any_of(
        list_, [&](const Hit& hit) { return is_flagged(hit) && std::abs(root.t - hit.t) <= oracle_.enclosure(hit); });
  }

  void pair() {
    std::vector<bool> optional(roots_.size());
    for (std::size_t r = 0; r < roots_.size(); r++) optional[r] = oracle_.optional(roots_[r]) || enclosed(roots_[r]);
    verdict_.optional_roots = std::size_t(std::ranges::count(optional, true));
    const workloads::PairingRules rules{
        [&](std::size_t h, std::size_t r) { return oracle_.match(claims_[h], roots_[r]).off; },
        [&](std::size_t h) { return oracle_.excused(claims_[h]); }, [&](std::size_t r) { return bool(optional[r]); }};
    const workloads::Pairing found = workloads::pair_in_order(claims_.size(), roots_.size(), rules);
    for (const auto& [h, r] : found.pairs) compare(claims_[h], roots_[r]);
    for (const std::size_t h : found.lone_hits) alone(claims_[h]);
    for (const std::size_t r : found.lone_roots) {
      if (optional[r]) verdict_.optional_missed++;
      else fail(verdict_.missed, missed_severity, fmt::format("the root at t = {:.9g} is missed", roots_[r].t));
    }
  }

  void compare(const Hit& hit, const Root& root) {
    const Match match = oracle_.match(hit, root);
    verdict_.uneven += hit.t != root.t;
    if (match.off > 1) {
      fail(verdict_.misplaced, 1 - 1 / match.off,
           fmt::format("t = {:.9g} should be {:.9g}: off by {:.3g}", hit.t, root.t, match.difference));
    } else if (match.grazing) {
      verdict_.grazing++;
    } else {
      verdict_.largest_difference = std::max(verdict_.largest_difference, match.difference);
    }
  }

  void alone(const Hit& hit) {
    if (oracle_.excused(hit)) {
      verdict_.excused++;
    } else if (std::ranges::any_of(roots_, [&](const Root& root) { return oracle_.match(hit, root).off <= 1; })) {
      fail(verdict_.doubled, invented_severity, fmt::format("the root at t = {:.9g} is told twice", hit.t));
    } else {
      fail(verdict_.invented, invented_severity, fmt::format("there is no root at t = {:.9g}", hit.t));
    }
  }

  void fail(std::size_t& counter, double severity, std::string text) {
    counter++;
    if (severity <= verdict_.worst_severity) return;
    verdict_.worst_severity = severity;
    verdict_.worst_ray = index_;
    verdict_.worst = std::move(text);
  }

  std::string told() const {
    std::string text = "roots";
    for (const Root& root : roots_) text += fmt::format(" {:.9g}{}", root.t, oracle_.optional(root) ? "?" : "");
    text += "; hits";
    for (const Hit& hit : list_) text += fmt::format(" {:.9g}±{:.2g} {}", hit.t, hit.uncertainty, name_of(hit.status));
    return text;
  }

  const HitList& hits_;
  std::size_t index_;
  const RayOracle& oracle_;
  Ray ray_;
  HitStatus claim_;
  bool may_sample_;
  std::span<const Root> roots_;
  std::vector<Hit> list_, claims_;
  Verdict verdict_;
};

template <class T>
bool same(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

}  // namespace

void Verdict::add(const Verdict& other) {
  rays += other.rays, roots += other.roots, hits += other.hits;
  flagged_rays += other.flagged_rays, sampled_rays += other.sampled_rays, doubtful_rays += other.doubtful_rays;
  missed += other.missed, invented += other.invented, doubled += other.doubled;
  misplaced += other.misplaced, malformed += other.malformed;
  optional_roots += other.optional_roots, optional_missed += other.optional_missed, excused += other.excused;
  uneven += other.uneven, grazing += other.grazing;
  largest_difference = std::max(largest_difference, other.largest_difference);
  widest_enclosure = std::max(widest_enclosure, other.widest_enclosure);
  if (unit.empty()) unit = other.unit;
  if (other.worst_severity > worst_severity) {
    worst_severity = other.worst_severity;
    worst_ray = other.worst_ray;
    worst = other.worst;
  }
}

std::string Verdict::summary() const {
  std::string text = fmt::format("{} rays, {} roots, {} hits, {} rays flagged, {} grazing, |t - truth| <= {:.2g} {}; ",
                                 rays, roots, hits, flagged_rays, grazing, largest_difference, unit);
  if (sampled_rays > 0) text += fmt::format("{} rays sampled; ", sampled_rays);
  if (doubtful_rays > 0) text += fmt::format("{} rays doubtful; ", doubtful_rays);
  if (optional_missed > 0) text += fmt::format("{} of {} optional roots missed; ", optional_missed, optional_roots);
  if (widest_enclosure > 0) text += fmt::format("widest enclosure {:.2g} of the ray; ", widest_enclosure);
  return text + fmt::format("{} missed, {} invented, {} doubled, {} misplaced, {} malformed", missed, invented, doubled,
                            misplaced, malformed);
}

Verdict judge_ray(const HitList& hits, std::size_t index, const RayOracle& oracle, const Ray& ray, HitStatus claim,
                  bool may_sample) {
  return RayJudge(hits, index, oracle, ray, claim, may_sample).verdict();
}

Verdict judge(const HitList& hits, const Oracle& oracle, const RayBatch& rays) {
  constexpr std::size_t chunk = 1024;
  std::vector<Verdict> parts((rays.size() + chunk - 1) / chunk);
  parallel_for(parts.size(), [&](std::size_t part) {
    for (std::size_t i = part * chunk; i < std::min(rays.size(), (part + 1) * chunk); i++) {
      const Ray ray = rays[i];
      parts[part].add(judge_ray(hits, i, *oracle.on(i, ray), ray, oracle.claim(), oracle.may_sample()));
    }
  });
  Verdict verdict;
  verdict.unit = oracle.unit();
  for (const Verdict& part : parts) verdict.add(part);
  return verdict;
}

void expect_first(const HitList& all, const HitList& first, const std::string& where) {
  ASSERT_EQ(first.ray_count(), all.ray_count()) << where;
  std::size_t wrong = 0;
  std::string example;
  for (std::size_t i = 0; i < all.ray_count(); i++) {
    const std::size_t a = all.offsets()[i], f = first.offsets()[i];
    const bool some = all.offsets()[i + 1] > a;
    const std::size_t count = first.offsets()[i + 1] - f;
    if (count != (some ? 1u : 0u) ||
        (some && (first.t()[f] != all.t()[a] || first.status()[f] != all.status()[a] ||
                  (!all.coordinates().empty() && first.coordinates()[f].part != all.coordinates()[a].part)))) {
      if (wrong++ == 0) {
        example = fmt::format("; ray {}: {}, not {}", i,
                              count > 0 ? fmt::format("{:.9g} {}", first.t()[f], name_of(first.status()[f])) : "none",
                              some ? fmt::format("{:.9g} {}", all.t()[a], name_of(all.status()[a])) : "none");
      }
    }
  }
  EXPECT_EQ(wrong, 0u) << where << ": rays whose first hit is not the first of all hits" << example;
}

bool same_bytes(const HitList& a, const HitList& b) {
  bool all = same(a.offsets(), b.offsets()) && same(a.ray_status(), b.ray_status());
#define HIT_COLUMN(name, type, names, place) all = all && same(a.name(), b.name());
#include "smurf/hit_columns.def"
  return all;
}

}  // namespace smurf::test
