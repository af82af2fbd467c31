#include "harness/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "numerics/parallel.hpp"

namespace smurf::test {
namespace {

// Kinds of failure in order of severity; differences of t come below 1.
constexpr double malformed_severity = 4, missed_severity = 3, invented_severity = 2;

class RayJudge {
 public:
  RayJudge(const GridField& field, double isovalue, const Judging& judging)
      : field_(field), isovalue_(isovalue), judging_(judging) {}

  void judge(std::size_t index, const Ray& ray, std::span<const Root> roots, const HitList& hits) {
    const std::size_t first = hits.offsets()[index], last = hits.offsets()[index + 1];
    verdict_.rays++;
    verdict_.roots += roots.size();
    verdict_.hits += last - first;
    if (hits.ray_status()[index] != RayStatus::ok) {
      fail(index, verdict_.malformed, malformed_severity, "the ray is called invalid");
      return;
    }
    const RayLine line(field_, ray);
    if (!well_formed(index, ray, line, hits, first, last)) return;

    // Roots need not be hit where they are uncertain, at a border, or enclosed by a flagged hit.
    std::vector<bool> optional(roots.size()), taken(roots.size(), false);
    for (std::size_t r = 0; r < roots.size(); r++)
      optional[r] = !roots[r].certain || line.at_border(roots[r].t, judging_.border);
    bool flagged = false;
    for (std::size_t i = first; i < last; i++) {
      if (hits.status()[i] == HitStatus::isolated) continue;
      flagged = true;
      enclose(line, hits.t()[i], hits.uncertainty()[i], roots, optional);
    }
    std::size_t next = 0;
    for (std::size_t i = first; i < last; i++)
      if (hits.status()[i] == HitStatus::isolated) pair(index, line, hits.t()[i], roots, optional, taken, next);
    for (std::size_t r = 0; r < roots.size(); r++)
      if (!taken[r] && !optional[r])
        fail(index, verdict_.missed, missed_severity, fmt::format("the root at t = {:.9g} is missed", roots[r].t));
    verdict_.flagged_rays += flagged;
  }

  const Verdict& verdict() const { return verdict_; }

 private:
  bool well_formed(std::size_t index, const Ray& ray, const RayLine& line, const HitList& hits, std::size_t first,
                   std::size_t last) {
    for (std::size_t i = first; i < last; i++) {
      const float t = hits.t()[i];
      std::string wrong;
      if (!(t >= ray.t_min && t <= ray.t_max)) wrong = fmt::format("t = {} is outside of the range asked for", t);
      if (i > first && t < hits.t()[i - 1]) wrong = fmt::format("t = {} comes after {}", t, hits.t()[i - 1]);
      if (!(hits.uncertainty()[i] >= 0)) wrong = fmt::format("the uncertainty is {}", hits.uncertainty()[i]);
      if (hits.rays()[i] != index) wrong = fmt::format("the hit says that it is of ray {}", hits.rays()[i]);
      // The location is origin + t·direction up to rounding.
      const glm::dvec3 p = line.at(t), q(hits.locations()[i]);
      const double size =
          glm::length(glm::dvec3(ray.origin)) + std::abs(double(t)) * glm::length(glm::dvec3(ray.direction));
      if (!(glm::length(p - q) <= 4 * 0x1p-23 * size))
        wrong = fmt::format("its location is off by {:.3g}", glm::length(p - q));
      if (wrong.empty()) continue;
      fail(index, verdict_.malformed, malformed_severity, fmt::format("hit {}: {}", i - first, wrong));
      return false;
    }
    return true;
  }

  // Roots within a flagged hit's enclosure are accounted for.
  void enclose(const RayLine& line, double t, double uncertainty, std::span<const Root> roots,
               std::vector<bool>& optional) const {
    const double margin = uncertainty + (judging_.t_tolerance + line.rounding(t)) / line.voxels();
    for (std::size_t r = 0; r < roots.size(); r++)
      if (std::abs(roots[r].t - t) <= margin) optional[r] = true;
  }

  // Pairs an isolated hit with the nearest root that it can be.
  void pair(std::size_t index, const RayLine& line, double t, std::span<const Root> roots,
            const std::vector<bool>& optional, std::vector<bool>& taken, std::size_t& next) {
    // The next root in order, unless that one may be left out and the one after it is nearer.
    while (next + 1 < roots.size() && optional[next] && std::abs(roots[next + 1].t - t) < std::abs(roots[next].t - t))
      next++;
    const double difference = next < roots.size() ? std::abs(roots[next].t - t) * line.voxels() : 1e300;
    if (difference <= judging_.t_tolerance + line.rounding(t)) {
      verdict_.largest_difference = std::max(verdict_.largest_difference, difference - line.rounding(t));
      taken[next++] = true;
    } else if (difference <= 1.0 / 16 && value_is_right(line, t)) {
      verdict_.grazing++;
      taken[next++] = true;
    } else if (line.at_border(t, judging_.border)) {
      // A root that rounding moved into the range.
    } else if (difference <= 1.0 / 16) {
      fail(index, verdict_.misplaced, difference,
           fmt::format("t = {:.9g} should be {:.9g}: off by {:.3g} voxels", t, roots[next].t, difference));
      taken[next++] = true;
    } else {
      fail(index, verdict_.invented, invented_severity, fmt::format("there is no root at t = {:.9g}", t));
    }
  }

  bool value_is_right(const RayLine& line, double t) const {
    const auto value = field_.value(line.at(t));
    return value && std::abs(*value - isovalue_) <= judging_.value_tolerance;
  }

  void fail(std::size_t index, std::size_t& counter, double severity, std::string text) {
    counter++;
    if (severity <= verdict_.worst_severity) return;
    verdict_.worst_severity = severity;
    verdict_.worst_ray = index;
    verdict_.worst = std::move(text);
  }

  const GridField& field_;
  double isovalue_;
  Judging judging_;
  Verdict verdict_;
};

}  // namespace

void Verdict::add(const Verdict& other) {
  rays += other.rays, roots += other.roots, hits += other.hits, flagged_rays += other.flagged_rays;
  missed += other.missed, invented += other.invented, misplaced += other.misplaced, malformed += other.malformed;
  grazing += other.grazing;
  largest_difference = std::max(largest_difference, other.largest_difference);
  if (other.worst_severity > worst_severity) {
    worst_severity = other.worst_severity;
    worst_ray = other.worst_ray;
    worst = other.worst;
  }
}

std::string Verdict::summary() const {
  return fmt::format(
      "{} rays, {} roots, {} hits, {} rays flagged, {} grazing, |t - truth| <= {:.2g} voxel; {} missed, {} invented, "
      "{} "
      "misplaced, {} malformed",
      rays, roots, hits, flagged_rays, grazing, largest_difference, missed, invented, misplaced, malformed);
}

Verdict judge(const HitList& hits, const Truth& truth, const GridField& field, double isovalue, const RayBatch& rays,
              const Judging& judging) {
  constexpr std::size_t chunk = 4096;
  std::vector<Verdict> parts((rays.size() + chunk - 1) / chunk);
  parallel_for(parts.size(), [&](std::size_t part) {
    RayJudge judge(field, isovalue, judging);
    for (std::size_t i = part * chunk; i < std::min(rays.size(), (part + 1) * chunk); i++)
      judge.judge(i, rays[i], truth.roots(i), hits);
    parts[part] = judge.verdict();
  });
  Verdict verdict;
  for (const Verdict& part : parts) verdict.add(part);
  return verdict;
}

}  // namespace smurf::test
