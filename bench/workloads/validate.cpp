#include "workloads/validate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "workloads/pairing.hpp"

namespace smurf::workloads {

struct Errors {
  std::vector<double> t, value, normal, curvature;
};

namespace {

constexpr std::size_t random_sample = 2048, hit_sample = 1024;

Spread spread_of(std::vector<double> errors) {
  Spread spread;
  if (errors.empty()) return spread;
  std::ranges::sort(errors);
  spread.median = errors[errors.size() / 2];
  spread.p99 = errors[std::min(errors.size() - 1, errors.size() * 99 / 100)];
  spread.worst = errors.back();
  return spread;
}

// Distinct indices below count, ascending.
std::vector<std::size_t> draw(std::size_t count, std::size_t wanted, std::uint64_t seed) {
  std::vector<std::size_t> indices;
  if (count <= wanted) {
    for (std::size_t i = 0; i < count; i++) indices.push_back(i);
    return indices;
  }
  Dice dice(seed);
  while (indices.size() < wanted) {
    while (indices.size() < wanted) indices.push_back(dice.below(count));
    std::ranges::sort(indices);
    const auto doubles = std::ranges::unique(indices);
    indices.erase(doubles.begin(), doubles.end());
  }
  return indices;
}

RayBatch gather(const RayBatch& rays, const std::vector<std::size_t>& indices) {
  RayBatch some(indices.size());
  for (std::size_t i = 0; i < indices.size(); i++) some.set(i, rays[indices[i]]);
  return some;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// NaN counts as the worst error, unless both are.
double difference(double a, double b) {
  if (std::isnan(a) && std::isnan(b)) return 0;
  const double d = std::abs(a - b);
  return std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
}

double angle(glm::dvec3 a, glm::dvec3 b) {
  if (std::isnan(a.x) && std::isnan(b.x)) return 0;
  const double result = std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
  return std::isnan(result) ? std::numeric_limits<double>::infinity() : result;
}

// Compares what both have measured, point i of one with point j of the other.
void compare_point(const PointProperties& mine, std::size_t i, const PointProperties& truth, std::size_t j,
                   double range, Errors& errors) {
  const std::uint32_t both = mine.measured & truth.measured;
  if (contains(both, Property::value)) errors.value.push_back(difference(mine.value[i], truth.value[j]) / range);
  if (contains(both, Property::normal)) errors.normal.push_back(angle(mine.normal[i], truth.normal[j]));
  if (contains(both, Property::principal)) {
    const double error = std::max(difference(mine.k1[i], truth.k1[j]), difference(mine.k2[i], truth.k2[j]));
    const double size = std::max(std::abs(truth.k1[j]), std::abs(truth.k2[j]));
    errors.curvature.push_back(error > 0 ? error / size : 0);
  }
}

void summarize(const Errors& errors, Verdict& verdict) {
  verdict.t = spread_of(errors.t);
  verdict.value = spread_of(errors.value);
  verdict.normal = spread_of(errors.normal);
  verdict.curvature = spread_of(errors.curvature);
}

}  // namespace

ReferenceAnswers::ReferenceAnswers(const Workload& workload, const Interrogator& reference, const RayBatch& rays,
                                   const std::vector<std::size_t>& hit_rays)
    : kind_(workload.kind),
      properties_(workload.properties),
      voxel_(workload.length_unit()),
      range_(workload.value_unit()) {
  const std::vector<std::size_t> anywhere = draw(rays.size(), random_sample, 1);
  sample_ = anywhere;
  for (std::size_t i : draw(hit_rays.size(), hit_sample, 2)) sample_.push_back(hit_rays[i]);
  std::ranges::sort(sample_);
  const auto doubles = std::ranges::unique(sample_);
  sample_.erase(doubles.begin(), doubles.end());

  const RayBatch some = gather(rays, anywhere);
  const auto start = std::chrono::steady_clock::now();
  reference.cast(some, workload.cast_options());
  rate_ = double(some.size()) / seconds_since(start);

  CastOptions options = workload.cast_options();
  options.hits = Hits::all;
  hits_ = reference.cast(gather(rays, sample_), options);
  hits_.properties(workload.properties);
}

ReferenceAnswers::ReferenceAnswers(const Workload& workload, const Interrogator& reference,
                                   const std::vector<glm::vec3>& points)
    : kind_(workload.kind),
      properties_(workload.properties),
      voxel_(workload.length_unit()),
      range_(workload.value_unit()) {
  sample_ = draw(points.size(), 2 * random_sample, 1);
  std::vector<glm::vec3> some;
  for (std::size_t i : sample_) some.push_back(points[i]);
  const auto start = std::chrono::steady_clock::now();
  probed_ = reference.probe(some, workload.properties);
  rate_ = double(some.size()) / seconds_since(start);
}

// Both lists of a ray ascend in t and are paired in that order, where they lie within `same_root`. A first-hit query is
// held to the reference's hits up to the hit that it reports.
void ReferenceAnswers::judge_ray(const HitList& hits, std::size_t sample, Verdict& verdict, Errors& errors) const {
  const std::size_t ray = sample_[sample];
  const double tolerance = same_root * voxel_;
  const auto mine = hits.t(), truth = hits_.t();
  const std::size_t d_begin = hits.offsets()[ray], d_end = hits.offsets()[ray + 1];
  const std::size_t r_begin = hits_.offsets()[sample];
  std::size_t r_end = hits_.offsets()[sample + 1];
  if (kind_ == Kind::first_hit) {
    std::size_t expected = r_begin;
    while (d_begin < d_end && expected < r_end && truth[expected] < mine[d_begin] - tolerance) expected++;
    if (expected < r_end && (d_begin == d_end || truth[expected] <= mine[d_begin] + tolerance)) expected++;
    r_end = expected;
  }
  verdict.expected_hits += r_end - r_begin;

  auto flagged_at = [&](double t) {
    for (std::size_t i = d_begin; i < d_end; i++)
      if (hits.status()[i] != HitStatus::isolated && std::abs(mine[i] - t) <= double(hits.uncertainty()[i]) + tolerance)
        return true;
    for (std::size_t i = r_begin; i < hits_.offsets()[sample + 1]; i++)
      if (hits_.status()[i] != HitStatus::isolated &&
          std::abs(truth[i] - t) <= double(hits_.uncertainty()[i]) + tolerance)
        return true;
    return false;
  };
  auto differs = [&](std::size_t& counter, double t) {
    if (flagged_at(t)) {
      verdict.excused++;
      return;
    }
    counter++;
    if (!verdict.worst_ray) verdict.worst_ray = ray;
  };

  const PointProperties& my_points = hits.properties(properties_);
  const PointProperties& true_points = hits_.properties(properties_);
  const PairingRules rules{[&](std::size_t h, std::size_t k) {
                             const double off = std::abs(double(mine[d_begin + h]) - truth[r_begin + k]) / tolerance;
                             return off <= 1 ? off : another_root;
                           },
                           [&](std::size_t h) { return flagged_at(mine[d_begin + h]); },
                           [&](std::size_t k) { return flagged_at(truth[r_begin + k]); }};
  const Pairing found = pair_in_order(d_end - d_begin, r_end - r_begin, rules);
  for (const std::size_t h : found.lone_hits) differs(verdict.invented, mine[d_begin + h]);
  for (const std::size_t k : found.lone_roots) differs(verdict.missed, truth[r_begin + k]);
  for (const auto& [h, k] : found.pairs) {
    const std::size_t d = d_begin + h, r = r_begin + k;
    if (hits.status()[d] != HitStatus::isolated || hits_.status()[r] != HitStatus::isolated) continue;
    errors.t.push_back(difference(mine[d], truth[r]) / voxel_);
    compare_point(my_points, d, true_points, r, range_, errors);
  }
}

Verdict ReferenceAnswers::judge(const HitList& hits) const {
  Verdict verdict;
  Errors errors;
  verdict.sampled = sample_.size();
  double worst = -1;
  std::optional<std::size_t> worst_ray;
  for (std::size_t i = 0; i < sample_.size(); i++) {
    const std::size_t before = errors.t.size();
    judge_ray(hits, i, verdict, errors);
    for (std::size_t k = before; k < errors.t.size(); k++) {
      if (errors.t[k] <= worst) continue;
      worst = errors.t[k];
      worst_ray = sample_[i];
    }
  }
  if (!verdict.worst_ray) verdict.worst_ray = worst_ray;
  summarize(errors, verdict);
  return verdict;
}

Verdict ReferenceAnswers::judge(const PointProperties& answers) const {
  Verdict verdict;
  Errors errors;
  verdict.sampled = sample_.size();
  double worst = -1;
  for (std::size_t i = 0; i < sample_.size(); i++) {
    compare_point(answers, sample_[i], probed_, i, range_, errors);
    if (errors.value.empty() || errors.value.back() <= worst) continue;
    worst = errors.value.back();
    verdict.worst_ray = sample_[i];
  }
  summarize(errors, verdict);
  return verdict;
}

}  // namespace smurf::workloads
