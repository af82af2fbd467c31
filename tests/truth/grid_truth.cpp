#include "truth/grid_truth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "numerics/parallel.hpp"
#include "reference/grid/roots.hpp"

namespace smurf::test {
namespace {

// Of the largest sample of a cell: how well double precision knows the field.
constexpr double certainty = 1e-12;

bool can_be_cast(const Ray& ray) {
  return std::isfinite(glm::dot(glm::dvec3(ray.origin), glm::dvec3(1.0))) &&
         std::isfinite(glm::dot(glm::dvec3(ray.direction), glm::dvec3(1.0))) && ray.direction != glm::vec3(0.0f) &&
         std::isfinite(ray.t_min) && ray.t_min <= ray.t_max;
}

class GridRayOracle : public RayOracle {
 public:
  GridRayOracle(const GridField& field, double isovalue, const GridTolerances& allowed, const Ray& ray,
                std::span<const Root> roots)
      : field_(field), isovalue_(isovalue), allowed_(allowed), line_(field, ray), roots_(roots) {}

  std::span<const Root> roots() const override { return roots_; }
  bool optional(const Root& root) const override { return !root.certain || line_.at_border(root.t, allowed_.border); }
  Match match(const Hit& hit, const Root& root) const override {
    const double difference = std::abs(root.t - hit.t) * line_.voxels(), rounding = line_.rounding(hit.t);
    if (difference <= allowed_.t + rounding) return {difference / (allowed_.t + rounding), difference - rounding};
    if (!(difference <= allowed_.same)) return {};
    if (value_is_right(hit.t)) return {.off = 1, .difference = difference, .grazing = true};
    return {difference / (allowed_.t + rounding), difference};
  }
  // A root that rounding moved into the range.
  bool excused(const Hit& hit) const override { return line_.at_border(hit.t, allowed_.border); }
  double enclosure(const Hit& hit) const override {
    return hit.uncertainty + (allowed_.t + line_.rounding(hit.t)) / line_.voxels();
  }

 private:
  bool value_is_right(double t) const {
    const auto value = field_.value(line_.at(t));
    return value && std::abs(*value - isovalue_) <= allowed_.value;
  }

  const GridField& field_;
  double isovalue_;
  const GridTolerances& allowed_;
  RayLine line_;
  std::span<const Root> roots_;
};

}  // namespace

GridRoots::GridRoots(const std::shared_ptr<const GridField>& field, double isovalue, const RayBatch& rays) {
  constexpr std::size_t chunk = 256;
  const RayRoots finder(field, isovalue, certainty);
  std::vector<std::vector<ReferenceHit>> found(rays.size());
  parallel_for((rays.size() + chunk - 1) / chunk, [&](std::size_t part) {
    for (std::size_t i = part * chunk; i < std::min(rays.size(), (part + 1) * chunk); i++) {
      const Ray ray = rays[i];
      if (can_be_cast(ray))
        finder.find({glm::dvec3(ray.origin), glm::dvec3(ray.direction), ray.t_min, ray.t_max}, false, found[i]);
    }
  });
  for (const auto& hits : found) {
    for (const ReferenceHit& hit : hits) roots_.push_back({hit.t, hit.status == HitStatus::isolated});
    offsets_.push_back(roots_.size());
  }
}

GridRoots::GridRoots(std::span<const std::vector<double>> roots) {
  for (const auto& of_ray : roots) {
    for (double t : of_ray) roots_.push_back({t});
    offsets_.push_back(roots_.size());
  }
}

RayLine::RayLine(const GridField& field, const Ray& ray)
    : origin_(ray.origin),
      direction_(ray.direction),
      index_origin_(field.to_index(origin_)),
      index_direction_(field.direction_to_index(direction_)),
      last_(field.size() - 1),
      t_min_(ray.t_min),
      t_max_(ray.t_max),
      voxels_(glm::length(index_direction_)) {}

double RayLine::rounding(double t) const { return 0x1p-23 * std::abs(t) * voxels_; }

bool RayLine::at_border(double t, double voxels) const {
  const double near = voxels + rounding(t);
  if ((t - t_min_) * voxels_ <= near || (t_max_ - t) * voxels_ <= near) return true;
  const glm::dvec3 p = index_origin_ + t * index_direction_;
  for (int axis = 0; axis < 3; axis++)
    if (p[axis] <= near || p[axis] >= last_[axis] - near) return true;
  return false;
}

GridOracle::GridOracle(std::shared_ptr<const GridField> field, double isovalue, GridRoots roots,
                       const GridTolerances& allowed)
    : field_(std::move(field)), isovalue_(isovalue), roots_(std::move(roots)), allowed_(allowed) {}

std::unique_ptr<const RayOracle> GridOracle::on(std::size_t index, const Ray& ray) const {
  return std::make_unique<GridRayOracle>(*field_, isovalue_, allowed_, ray, roots_.roots(index));
}

}  // namespace smurf::test
