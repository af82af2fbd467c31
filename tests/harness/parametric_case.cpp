#include "harness/parametric_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <utility>

#include "harness/density.hpp"
#include "harness/replay.hpp"
#include "harness/tolerances.hpp"
#include "numerics/parallel.hpp"

namespace smurf::test {

namespace {

constexpr std::string_view kind = "parametric";

}  // namespace

double slope_of(const PatchPoint& p, const glm::dvec3& direction) {
  const glm::dvec3 normal = glm::cross(p.u, p.v);
  const double length = glm::length(normal) * glm::length(direction);
  return length > 0 ? std::abs(glm::dot(normal, direction)) / length : 1;
}

ParametricRules::ParametricRules(double extent)
    : extent_(extent), roundings_(tolerance(Quantity::t, kind).value), place_(tolerance(Quantity::place, kind).value) {}

Match ParametricRules::match(const Ray& ray, const Hit& hit, double t, double slope, double apart) const {
  const double speed = glm::length(glm::dvec3(ray.direction)), off = std::abs(hit.t - t);
  const double rounding = this->rounding(t);
  // Across the surface what is promised; along the ray, and along the surface, as much more as they are aslant. Close
  // to a double root only the enclosure tells.
  const double allowed =
      std::max(place_ * extent_ / std::max(slope, 1e-12), speed * hit.uncertainty) + speed * rounding;
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
    const glm::dvec2 place = of_.place_of ? of_.place_of(hit.place) : glm::dvec2(hit.place.u, hit.place.v);
    const double slope = slope_of(of_.scene.at(exact.place.x, exact.place.y), glm::dvec3(ray_.direction));
    return rules_.match(ray_, hit, root.t, slope, distance_on(of_.scene, place, exact.place));
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

// ---- Against another list

PlaceRules rules_of(const ParametricScene& scene) {
  return {.extent = extent_of(sampled_bounds(scene)),
          .distance =
              [scene](const SurfaceCoordinates& a, const SurfaceCoordinates& b) {
                return distance_on(scene, {a.u, a.v}, {b.u, b.v});
              },
          .slope = [scene](const SurfaceCoordinates& at,
                           const glm::dvec3& direction) { return slope_of(scene.at(at.u, at.v), direction); },
          .to_end =
              [scene](const SurfaceCoordinates& at) {
                const PatchPoint p = scene.at(at.u, at.v);
                double least = HUGE_VAL;
                for (int axis = 0; axis < 2; axis++) {
                  if (scene.closed[std::size_t(axis)] || !scene.poles.empty()) continue;
                  const double x = axis == 0 ? at.u : at.v;
                  least = std::min(least, std::min(x - scene.lower[axis], scene.upper[axis] - x) *
                                              glm::length(axis == 0 ? p.u : p.v));
                }
                return least;
              }};
}

PlaceRules rules_of(const std::vector<Patch>& patches) {
  const double extent = extent_of(patches);
  // Sides that no other meets.
  std::vector<std::array<bool, 4>> ends(patches.size(), {true, true, true, true});
  for (const Side& side : collapsed_sides(patches, 1e-6 * extent)) ends[side.patch][std::size_t(side.side)] = false;
  for (const SharedEdge& edge : shared_edges(patches, 1e-6 * extent)) {
    for (const Side& side : {edge.a, edge.b}) ends[side.patch][std::size_t(side.side)] = false;
  }
  return {.extent = extent,
          .distance =
              [patches](const SurfaceCoordinates& a, const SurfaceCoordinates& b) {
                const PatchPoint hit = point_of(patches[a.part], a.u, a.v), truth = point_of(patches[b.part], b.u, b.v);
                const double straight = glm::distance(hit.position, truth.position);
                const Patch& patch = patches[b.part];
                bool at_side = a.part != b.part;
                for (int axis = 0; axis < 2; axis++) {
                  const double at = axis == 0 ? b.u : b.v, near = 1e-4 * (patch.upper(axis) - patch.lower(axis));
                  at_side = at_side || at < patch.lower(axis) + near || at > patch.upper(axis) - near;
                }
                if (at_side) return straight;
                return std::max(straight, std::abs(double(a.u) - b.u) * glm::length(truth.u) +
                                              std::abs(double(a.v) - b.v) * glm::length(truth.v));
              },
          .slope =
              [patches](const SurfaceCoordinates& at, const glm::dvec3& direction) {
                return slope_of(point_of(patches[at.part], at.u, at.v), direction);
              },
          .to_end =
              [patches, ends](const SurfaceCoordinates& at) {
                const Patch& patch = patches[at.part];
                const PatchPoint p = point_of(patch, at.u, at.v);
                double least = HUGE_VAL;
                for (int side = 0; side < 4; side++) {
                  if (!ends[at.part][std::size_t(side)]) continue;
                  const double x = side < 2 ? at.u : at.v;
                  const double away = side % 2 == 0 ? x - patch.lower(side / 2) : patch.upper(side / 2) - x;
                  least = std::min(least, away * glm::length(side < 2 ? p.u : p.v));
                }
                return least;
              }};
}

std::shared_ptr<const Oracle> oracle_by_list(const HitList& truth, const PlaceRules& places) {
  const ParametricRules rules(places.extent);
  HitListRules judged;
  judged.match = [=](const Ray& ray, const Hit& hit, const Root& root) {
    Hit widened = hit;
    widened.uncertainty += truth.uncertainty()[root.row];
    const SurfaceCoordinates& exact = truth.coordinates()[root.row];
    const double slope = places.slope(exact, glm::dvec3(ray.direction));
    double apart = places.distance(hit.place, exact);
    // Where the surface passes through itself, hits with one t come in any order.
    const std::size_t index = truth.rays()[root.row];
    for (std::size_t i = truth.offsets()[index]; i < truth.offsets()[index + 1]; i++) {
      if (std::abs(double(truth.t()[i]) - root.t) <= widened.uncertainty + rules.rounding(root.t))
        apart = std::min(apart, places.distance(hit.place, truth.coordinates()[i]));
    }
    return rules.match(ray, widened, root.t, slope, apart);
  };
  // Within rounding of an end of the range of t, or of where the surface ends, a hit may be there or not.
  const auto at_end = [=](const Ray& ray, double t, const SurfaceCoordinates& place) {
    const glm::dvec3 direction(ray.direction);
    const double near = 2e-6 * places.extent, margin = 4 * rules.rounding(t) + near / glm::length(direction);
    return t < ray.t_min + margin || t > ray.t_max - margin ||
           places.to_end(place) < near / std::max(1e-3, places.slope(place, direction));
  };
  judged.certain = [=](const Ray& ray, std::span<const Root> roots, std::size_t k) {
    return !at_end(ray, roots[k].t, truth.coordinates()[roots[k].row]);
  };
  judged.excused = [=](const Ray& ray, const Hit& hit) { return at_end(ray, hit.t, hit.place); };
  judged.unit = "of the extent";
  return std::make_shared<HitListOracle>(truth, judged);
}

std::shared_ptr<const Oracle> oracle_by_reference(const Surface& surface, const RayBatch& rays,
                                                  const PlaceRules& rules) {
  return oracle_by_list(Interrogator(reference_device(), surface).cast(rays, {.hits = Hits::all}), rules);
}

// ---- Points

PointOracle parametric_points(std::span<const SurfaceCoordinates> places, double extent, PointAt at,
                              std::string_view of_kind) {
  const double normal = tolerance(Quantity::normal, of_kind).value,
               curvature = tolerance(Quantity::curvature, of_kind).value,
               floor = tolerance(Quantity::curvature_floor, of_kind).value,
               rounding = tolerance(Quantity::conditioning, of_kind).value * 0x1p-24;
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
    const double second = std::max(
        {glm::length(point->uu) / (u * u), glm::length(point->uv) / (u * v), glm::length(point->vv) / (v * v)});
    // So is a first derivative that is much the shorter: the sum of terms of the other's size.
    const double uneven = std::max(u, v) / std::min(u, v);
    const double off = (curvature * size + rounding * (second + uneven * size)) * worse * worse;
    truth.principal = off;
    truth.mean = off;
    truth.gauss = 2 * size * off;
    truth.along = 2 * off;
    const double difference = exact->k1 - exact->k2;
    if (difference > 0.05 * size) truth.direction = 4 * off / difference + truth.normal;
    return truth;
  };
}

// ---- Cases

Case case_of(const ParametricScene& scene) {
  return {.name = scene.name,
          .surface = scene.surface(),
          .replay = [json = scene.description()](const std::string& name, const Ray& ray, const std::string& device) {
            return replay_command(name + " " + device, json, ray, device);
          }};
}

namespace {

std::string numbers(const auto& list) {
  std::string text;
  for (const auto& x : list) text += fmt::format("{}{}", text.empty() ? "" : ",", x);
  return "[" + text + "]";
}

std::string json_of(const std::vector<Patch>& patches) {
  std::string text;
  for (const Patch& p : patches) {
    std::string points;
    for (const glm::dvec4& x : p.points)
      points += fmt::format("{}[{},{},{},{}]", points.empty() ? "" : ",", x.x, x.y, x.z, x.w);
    text += fmt::format(R"({}{{"homogeneous":true,"degree":{},"size":{},"knots":[{},{}],"points":[{}]}})",
                        text.empty() ? "" : ",\n", numbers(p.degree), numbers(p.size), numbers(p.knots[0]),
                        numbers(p.knots[1]), points);
  }
  return R"({"patches":[)" + text + "]}\n";
}

}  // namespace

Case case_of(const std::string& name, const std::vector<Patch>& patches) {
  return {.name = name,
          .surface = nurbs(patches),
          .replay = [patches](const std::string& file, const Ray& ray, const std::string& device) {
            std::string data = file + " patches.json";
            std::ranges::replace_if(
                data, [](unsigned char c) { return !std::isalnum(c) && c != '.'; }, '-');
            std::ofstream(output_folder() / data) << json_of(patches);
            const std::string json = fmt::format("{{\"kind\":\"nurbs\",\"file\":\"{}\"}}\n", data);
            return replay_command(file + " " + device, json, ray, device);
          }};
}

std::vector<TestDevice> devices_for_expressions(bool everywhere) {
  if (everywhere || density() > 1) return test_devices();
  std::vector<TestDevice> devices = one_of_each();
  std::erase_if(devices, [](const TestDevice& device) { return device.device.is_reference(); });
  return devices;
}

bool is_flagged(const HitList& hits, std::size_t ray) {
  for (std::size_t i = hits.offsets()[ray]; i < hits.offsets()[ray + 1]; i++)
    if (hits.status()[i] == HitStatus::tangent || hits.status()[i] == HitStatus::unresolved) return true;
  return false;
}

std::size_t flagged_rays(const HitList& hits) {
  std::size_t flagged = 0;
  for (std::size_t ray = 0; ray < hits.ray_count(); ray++) flagged += is_flagged(hits, ray);
  return flagged;
}

std::size_t odd_rays(const HitList& hits) {
  std::size_t odd = 0;
  for (std::size_t ray = 0; ray < hits.ray_count(); ray++)
    odd += (hits.offsets()[ray + 1] - hits.offsets()[ray]) % 2 == 1 && !is_flagged(hits, ray);
  return odd;
}

}  // namespace smurf::test
