#include "harness/stream_case.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "harness/replay.hpp"
#include "harness/tolerances.hpp"
#include "numerics/parallel.hpp"

namespace smurf::test {
namespace {

constexpr std::string_view kind = "stream";

}  // namespace

class StreamRay : public RayOracle {
 public:
  StreamRay(const StreamOracle& of, std::size_t index, const Ray& ray)
      : of_(of), found_(of.roots_[index]), direction_(ray.direction) {
    for (std::size_t i = 0; i < found_.at.size(); i++) roots_.push_back({found_.at[i].t, found_.at[i].certain, i});
  }

  std::span<const Root> roots() const override { return roots_; }
  bool doubtful() const override { return found_.doubtful; }
  double enclosure(const Hit& hit) const override { return hit.uncertainty + rounding(hit.t); }

  Match match(const Hit& hit, const Root& root) const override {
    const ParametricRoot& exact = found_.at[root.row];
    const PatchPoint p = of_.scene_.at(exact.place.x, exact.place.y);
    const double slope = slope_of(p, direction_), speed = glm::length(direction_);
    const double off = std::abs(hit.t - root.t) * speed;
    // Across the surface what is promised; along the ray, and along the surface, as much more as they are aslant; and
    // next to a fold as far as the surface bends away by so little.
    const double across = of_.place_ * of_.extent_;
    double allowed = across / std::max(slope, 1e-12);
    if (const auto bent = differential_of(p)) {
      const double along = std::max(std::abs(bent->k1), std::abs(bent->k2));
      allowed = std::min(allowed, across / std::max(slope, 0.1) + std::sqrt(2 * across / std::max(along, 1e-9)));
    }
    allowed += speed * rounding(root.t);
    // Where the surface goes over itself, hits with one t come in any order.
    double apart = HUGE_VAL;
    for (const ParametricRoot& other : found_.at) {
      if (std::abs(other.t - root.t) * speed > allowed) continue;
      apart = std::min(apart, distance_on(of_.parametric_, {hit.place.u, hit.place.v}, other.place));
    }
    const double part = std::max(off / allowed, apart / (2 * allowed));
    if (part > 1000) return {};
    return {part, off * slope / of_.extent_, slope < 1e-3};
  }
  // At the borders a hit may be there or not.
  bool excused(const Hit& hit) const override {
    return std::ranges::any_of(roots_, [&](const Root& root) { return !root.certain && match(hit, root).off <= 1; });
  }

 private:
  static double rounding(double t) { return tolerance(Quantity::t, kind).value * 0x1p-24 * std::abs(t); }

  const StreamOracle& of_;
  const ParametricRoots& found_;
  glm::dvec3 direction_;
  std::vector<Root> roots_;
};

StreamOracle::StreamOracle(const StreamScene& scene, const RayBatch& rays, double place)
    : scene_(scene), parametric_(scene.parametric()), extent_(extent_of(scene)), place_(place), roots_(rays.size()) {
  const double near = std::max(4e-6, 2 * place);  // rays round their origins and directions to floats
  parallel_for(rays.size(), [&](std::size_t i) {
    const Ray ray = rays[i];
    const glm::vec3 sum = ray.origin + ray.direction;
    if (std::isfinite(sum.x + sum.y + sum.z) && ray.direction != glm::vec3(0.0f) && ray.t_min <= ray.t_max)
      roots_[i] = roots_on(scene_, parametric_, extent_, near, ray);
  });
}

std::unique_ptr<const RayOracle> StreamOracle::on(std::size_t index, const Ray& ray) const {
  return std::make_unique<StreamRay>(*this, index, ray);
}

double extent_of(const StreamScene& scene) { return extent_of(sampled_bounds(scene.parametric())); }

std::vector<RayFamily> stream_rays(const StreamScene& scene, std::size_t random, std::size_t hostile, unsigned seed) {
  std::vector<RayFamily> families = parametric_families(scene.parametric(), random, hostile, seed);
  std::erase_if(families, [](const RayFamily& family) {
    if (family.random || !family.valid) return false;
    return family.name != "at seams and borders" && family.name != "from seam to seam" &&
           family.name != "along an axis" && family.name != "window of t" && family.name != "from inside" &&
           family.name != "long and short directions";
  });
  return families;
}

RayBatch chords_of(const Bounds& box, std::size_t count) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto within = [&] {
    return box.lower + glm::dvec3(uniform(random), uniform(random), uniform(random)) * (box.upper - box.lower);
  };
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const glm::dvec3 through = within(), d = glm::normalize(within() - through);
    rays.set(i, {glm::vec3(through - 2 * glm::distance(box.lower, box.upper) * d), glm::vec3(d)});
  }
  return rays;
}

Case case_of(const StreamScene& scene, const StreamOptions& options, double place) {
  Case one{.name = scene.name + (options.method == StreamMethod::mesh ? ", mesh" : ", back-stream"),
           .surface = scene.surface(options)};
  one.oracle = [scene, place](const RayFamily& family) {
    return std::make_shared<StreamOracle>(scene, family.rays, place);
  };
  one.replay = [json = scene.description(options.method)](const std::string& name, const Ray& ray,
                                                          const std::string& device) {
    return replay_command(name + " " + device, json, ray, device);
  };
  return one;
}

void expect_stream_properties(const StreamScene& scene, const Case& one, const HitList& hits,
                              const std::string& where) {
  const PointOracle points = parametric_points(
      hits.coordinates(), extent_of(scene),
      [&](const SurfaceCoordinates& c) { return std::optional(scene.at(c.u, c.v)); }, kind);
  // A crossing that is none has no place to measure at.
  expect_properties(
      one,
      [&](std::size_t i, const glm::dvec3& at) -> std::optional<PointTruth> {
        const HitStatus status = hits.status()[i];
        return status == HitStatus::isolated || status == HitStatus::sampled || status == HitStatus::bracketed
                   ? points(i, at)
                   : std::nullopt;
      },
      hits, where);
}

void expect_distinct(const StreamScene& scene, const HitList& hits, const std::string& where) {
  const double extent = extent_of(scene);
  const ParametricScene parametric = scene.parametric();
  std::size_t same = 0;
  std::string example;
  for (std::size_t i = 1; i < hits.size(); i++) {
    if (hits.rays()[i] != hits.rays()[i - 1]) continue;
    const SurfaceCoordinates a = hits.coordinates()[i - 1], b = hits.coordinates()[i];
    if (distance_on(parametric, {a.u, a.v}, {b.u, b.v}) > 1e-5 * extent) continue;
    if (same++ == 0) example = fmt::format("ray {}: u = {}, τ = {} twice", hits.rays()[i], a.u, a.v);
  }
  EXPECT_EQ(same, 0u) << where << ": " << example;
}

}  // namespace smurf::test
