#include "harness/parametric_case.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/tolerances.hpp"
#include "numerics/parallel.hpp"

namespace smurf::test {

namespace {

constexpr std::string_view kind = "parametric";

double slope_of(const PatchPoint& p, const glm::dvec3& direction) {
  const glm::dvec3 normal = glm::cross(p.u, p.v);
  const double length = glm::length(normal) * glm::length(direction);
  return length > 0 ? std::abs(glm::dot(normal, direction)) / length : 1;
}

}  // namespace

ParametricRules::ParametricRules(double extent)
    : extent_(extent), roundings_(tolerance(Quantity::t, kind).value), place_(tolerance(Quantity::place, kind).value) {}

Match ParametricRules::match(const Ray& ray, const Hit& hit, double t, double slope, double apart) const {
  const double speed = glm::length(glm::dvec3(ray.direction)), off = std::abs(hit.t - t);
  const double rounding = this->rounding(t);
  // Across the surface what is promised; along the ray, and along the surface, as much more as they are aslant. Close
  // to a double root only the enclosure tells.
  const double allowed = std::max(place_ * extent_ / std::max(slope, 1e-12), speed * hit.uncertainty) + speed * rounding;
  const double part = std::max({off / (hit.uncertainty + rounding), off * speed / allowed, apart / (2 * allowed)});
  // A hit as far off as this is of another root.
  if (part > 100) return {};
  return {part, off * speed * slope / extent_, slope < 1e-3};
}

// ---- Against exact roots

class ExactParametricRay : public RayOracle {
 public:
  ExactParametricRay(const ExactParametricOracle& of, std::size_t index, const Ray& ray)
      : of_(of), ray_(ray), rules_(of.extent), found_(of.roots_[index]) {
    for (std::size_t i = 0; i < found_.at.size(); i++) roots_.push_back({found_.at[i].t, found_.at[i].certain, i});
  }

  std::span<const Root> roots() const override { return roots_; }
  bool doubtful() const override { return found_.doubtful; }
  Match match(const Hit& hit, const Root& root) const override {
    const ParametricRoot& exact = found_.at[root.row];
    const SurfaceCoordinates& place = of_.coordinates_[hit.index];
    const double slope = slope_of(of_.scene.at(exact.place.x, exact.place.y), glm::dvec3(ray_.direction));
    return rules_.match(ray_, hit, root.t, slope, distance_on(of_.scene, {place.u, place.v}, exact.place));
  }
  double enclosure(const Hit& hit) const override { return hit.uncertainty + rules_.rounding(hit.t); }

 private:
  const ExactParametricOracle& of_;
  Ray ray_;
  ParametricRules rules_;
  const ParametricRoots& found_;
  std::vector<Root> roots_;
};

ExactParametricOracle::ExactParametricOracle(const ParametricScene& the_scene, const RayBatch& rays)
    : scene(the_scene), extent(extent_of(sampled_bounds(the_scene))), roots_(rays.size()) {
  const AlgebraicRoots exact(scene);
  parallel_for(rays.size(), [&](std::size_t i) {
    const Ray ray = rays[i];
    const glm::vec3 sum = ray.origin + ray.direction;
    if (std::isfinite(sum.x + sum.y + sum.z) && ray.direction != glm::vec3(0.0f) && ray.t_min <= ray.t_max)
      roots_[i] = exact.on(ray);
  });
}

std::unique_ptr<const RayOracle> ExactParametricOracle::on(std::size_t index, const Ray& ray) const {
  return std::make_unique<ExactParametricRay>(*this, index, ray);
}

std::size_t ExactParametricOracle::roots() const {
  std::size_t sum = 0;
  for (const ParametricRoots& roots : roots_) sum += roots.at.size();
  return sum;
}

// ---- Against another list

HitListOracle parametric_oracle(const HitList& hits, const HitList& truth, double extent, const PlaceDistance& distance,
                                const SlopeAt& slope) {
  const ParametricRules rules(extent);
  // The lists are copied: columns are small, and the oracle outlives the call.
  return {truth,
          {.match =
               [=](const Ray& ray, const Hit& hit, const Root& root) {
                 const SurfaceCoordinates &mine = hits.coordinates()[hit.index],
                                          &exact = truth.coordinates()[root.row];
                 Hit widened = hit;
                 widened.uncertainty += truth.uncertainty()[root.row];
                 return rules.match(ray, widened, root.t, slope(exact, glm::dvec3(ray.direction)),
                                    distance(mine, exact));
               },
           .certain =
               [=](const Ray& ray, std::span<const Root> roots, std::size_t k) {
                 // Within rounding of an end of the range of t a hit may be there or not.
                 const double t = roots[k].t;
                 const double off = 4 * rules.rounding(t) + 2 * truth.uncertainty()[roots[k].row];
                 return t > ray.t_min + off && t < ray.t_max - off;
               },
           .excused =
               [=](const Ray& ray, double t) {
                 const double off =
                     4 * rules.rounding(t) + 2e-6 * extent / glm::length(glm::dvec3(ray.direction));
                 return t < ray.t_min + off || t > ray.t_max - off;
               },
           .rounding = [](const Ray&) { return 0.0; },
           .unit = "of the extent"}};
}

// ---- Points

PointOracle parametric_points(std::span<const SurfaceCoordinates> places, double extent, PointAt at) {
  constexpr double normal = tolerance(Quantity::normal, kind).value,
                   curvature = tolerance(Quantity::curvature, kind).value,
                   floor = tolerance(Quantity::curvature_floor, kind).value,
                   rounding = tolerance(Quantity::conditioning, kind).value * 0x1p-24;
  return [=, at = std::move(at)](std::size_t i, const glm::dvec3&) -> std::optional<PointTruth> {
    const auto point = at(places[i]);
    if (!point) return std::nullopt;
    const auto exact = differential_of(*point);
    if (!exact) return std::nullopt;
    PointTruth truth;
    truth.exact = *exact;
    // Tangents that nearly agree, or one that is much the shorter, lose as many digits in their product.
    const double u = glm::length(point->u), v = glm::length(point->v);
    const double sine = glm::length(glm::cross(point->u, point->v)) / (u * v);
    const double worse = 1 / sine;
    truth.normal = normal * worse;
    const double size = std::max({std::abs(exact->k1), std::abs(exact->k2), floor / extent});
    // Second derivatives are rounded at their own size, which may be far above what is left across the surface.
    const double second = std::max({glm::length(point->uu) / (u * u), glm::length(point->uv) / (u * v),
                                    glm::length(point->vv) / (v * v)});
    const double off = (curvature * size + rounding * second) * worse * worse;
    truth.principal = off;
    truth.mean = off;
    truth.gauss = 2 * size * off;
    truth.along = 2 * off;
    const double difference = exact->k1 - exact->k2;
    if (difference > 0.05 * size) truth.direction = 4 * off / difference + truth.normal;
    return truth;
  };
}

double flagged_part(const HitList& hits) {
  std::size_t flagged = 0;
  for (std::size_t ray = 0; ray < hits.ray_count(); ray++) {
    bool any = false;
    for (std::size_t i = hits.offsets()[ray]; i < hits.offsets()[ray + 1]; i++)
      any = any || hits.status()[i] == HitStatus::tangent || hits.status()[i] == HitStatus::unresolved;
    flagged += any;
  }
  return hits.ray_count() > 0 ? double(flagged) / double(hits.ray_count()) : 0;
}

}  // namespace smurf::test
