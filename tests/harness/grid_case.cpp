#include "harness/grid_case.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/replay.hpp"
#include "harness/tolerances.hpp"

namespace smurf::test {
namespace {

constexpr std::string_view kind = "isosurface";

// The largest magnitude of a sample: a unit of rounding of the field is 2^-24 of it.
double magnitude_of(const Volume& volume) { return std::max(std::abs(volume.minimum()), std::abs(volume.maximum())); }

// Points of the surface with their normals, from the reference, for rays that are made to meet it badly.
std::vector<SurfaceSample> surface_samples(const GridCase& c) {
  const Interrogator query(reference_device(), isosurface(c.volume, c.isovalue, {c.reconstruction}));
  const HitList hits = query.cast(random_chords(frame_of(c.volume), 2000, c.seed + 1000).rays, {.hits = Hits::all});
  const auto normals = hits.normals();
  std::vector<SurfaceSample> samples;
  for (std::size_t i = 0; i < hits.size(); i++)
    if (std::isfinite(normals[i].x)) samples.push_back({glm::dvec3(hits.locations()[i]), glm::dvec3(normals[i])});
  return samples;
}

std::vector<RayFamily> families_of(const GridCase& c) {
  const GridFrame frame = frame_of(c.volume);
  std::vector<RayFamily> families{random_chords(frame, c.random_rays, c.seed),
                                  camera_rays(frame, c.random_rays, c.seed + 1)};
  if (c.hostile_rays == 0) return families;
  for (RayFamily& family : hostile_families(frame, surface_samples(c), c.hostile_rays, c.seed + 2))
    families.push_back(std::move(family));
  return families;
}

}  // namespace

GridTolerances tolerances_of(const GridCase& c) {
  return {.t = tolerance(Quantity::t, kind).value,
          .value =
              tolerance(Quantity::value, kind).value * 0x1p-24 * std::max(magnitude_of(c.volume), std::abs(c.isovalue)),
          .border = tolerance(Quantity::border, kind).value,
          .same = tolerance(Quantity::same_root, kind).value};
}

JetAt jets_of(const std::shared_ptr<const GridField>& field) {
  return [field](const glm::dvec3& point) -> std::optional<Jet> {
    const auto jet = field->jet(point);
    if (!jet) return {};
    return Jet{jet->value, jet->gradient, jet->hessian};
  };
}

PointOracle points_of(const GridCase& c, const JetAt& jet_at) {
  const double rounding = 0x1p-24 * magnitude_of(c.volume);
  const GridPlacement placement = c.volume.placement();
  const glm::dmat3 to_index = glm::inverse(placement.axes);
  // The voxel that curvature is measured by.
  const double step =
      std::min({glm::length(placement.axes[0]), glm::length(placement.axes[1]), glm::length(placement.axes[2])});
  const bool smooth = c.reconstruction == Reconstruction::tricubic;
  return [=](std::size_t, const glm::dvec3& point) -> std::optional<PointTruth> {
    // Derivatives that jump at cell faces are not compared on them: the point's rounding decides the side.
    const glm::dvec3 index = to_index * (point - placement.origin), off_face = glm::abs(index - glm::round(index));
    if (!smooth && std::min({off_face.x, off_face.y, off_face.z}) < 1e-3) return {};
    const auto jet = jet_at(point);
    if (!jet || jet->gradient == glm::dvec3(0.0)) return {};
    const double slope = glm::length(jet->gradient) * step;
    PointTruth truth{.exact = differential_of(*jet)};
    const double bend = std::max(std::abs(truth.exact.k1), std::abs(truth.exact.k2));
    const double scale = std::max(bend, tolerance(Quantity::curvature_floor, kind).value / step);
    // Rounding of second differences of the samples, in units of curvature.
    const double noise = tolerance(Quantity::conditioning, kind).value * rounding / (slope * step);
    if (!(noise <= tolerance(Quantity::tiny_gradient, kind).value * scale)) return {};
    const double allowed = tolerance(Quantity::curvature, kind).value * scale + noise;
    truth.normal =
        tolerance(Quantity::normal, kind).value + tolerance(Quantity::normal_rounding, kind).value * rounding / slope;
    truth.mean = truth.principal = allowed;
    truth.gauss = 2 * allowed * scale;
    truth.along = 2 * allowed;
    // Directions turn by the error of curvature over the difference of the principal ones.
    const double apart = truth.exact.k1 - truth.exact.k2;
    if (apart > 0.05 * scale)
      truth.direction =
          tolerance(Quantity::direction, kind).value / tolerance(Quantity::curvature, kind).value * allowed / apart;
    return truth;
  };
}

Case case_of(const GridCase& c, std::vector<RayFamily> families) {
  const auto field = std::make_shared<const GridField>(c.volume, c.reconstruction);
  const GridTolerances allowed = tolerances_of(c);
  return {.name = c.name,
          .surface = isosurface(c.volume, c.isovalue, {c.reconstruction}),
          .rays = std::move(families),
          .oracle =
              [=, isovalue = c.isovalue](const RayFamily& family) {
                return std::make_shared<GridOracle>(field, isovalue, GridRoots(field, isovalue, family.rays), allowed);
              },
          .points = points_of(c, jets_of(field)),
          .replay =
              [volume = c.volume, isovalue = c.isovalue, reconstruction = c.reconstruction](
                  const std::string& name, const Ray& ray, const std::string& device) {
                return replay_command(name, volume, isovalue, reconstruction, ray, device);
              },
          .slow_share = c.slow_share,
          .properties = c.properties,
          .seed = c.seed};
}

Case case_of(const GridCase& c) { return case_of(c, families_of(c)); }

}  // namespace smurf::test
