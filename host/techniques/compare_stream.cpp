// Compares the ways to normals and curvature at the hits of random chords, and the mesh with the true surface at random
// (u, τ). What is right is integrated, on the same device: the variational equations from the seed to each point.
#include <fmt/format.h>

#include <cmath>
#include <random>
#include <vector>

#include "smurf/compare.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "techniques/errors.hpp"

namespace smurf {
namespace {

constexpr std::uint32_t curved = Property::normal | Property::mean | std::uint32_t(Property::gauss);
constexpr StreamDerivatives compared[] = {StreamDerivatives::interpolated, StreamDerivatives::mesh,
                                          StreamDerivatives::neighbours};

void check(const StreamCompareOptions& options) {
  if (options.rays == 0) throw Error(ErrorCode::usage, "at least one ray is needed for a comparison");
  if (options.places == 0) throw Error(ErrorCode::usage, "at least one place is needed for a comparison");
}

std::vector<SurfaceCoordinates> random_places(const glm::dvec2& u, const glm::dvec2& time, std::size_t count,
                                              std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](const glm::dvec2& range) {
    return float(range.x + double(random() >> 11) * 0x1p-53 * (range.y - range.x));
  };
  std::vector<SurfaceCoordinates> places(count);
  for (SurfaceCoordinates& place : places) {
    place.u = between(u);
    place.v = between(time);
  }
  return places;
}

StreamComparisonRow compare_properties(const PointProperties& found, const PointProperties& right) {
  StreamComparisonRow row;
  Errors normal, mean, gauss;
  for (std::size_t i = 0; i < right.normal.size(); i++) {
    if (!std::isfinite(right.normal[i].x)) continue;
    if (!std::isfinite(found.normal[i].x)) {
      row.undefined++;
      continue;
    }
    normal.add(angle_between(glm::dvec3(found.normal[i]), glm::dvec3(right.normal[i])));
    if (!std::isfinite(found.mean[i]) || !std::isfinite(found.gauss[i])) {
      row.flat++;
      continue;
    }
    if (!std::isfinite(right.mean[i]) || !std::isfinite(right.gauss[i])) continue;
    mean.add(double(found.mean[i]) - double(right.mean[i]));
    gauss.add(double(found.gauss[i]) - double(right.gauss[i]));
  }
  row.normal = normal.measure();
  row.mean = mean.measure();
  row.gauss = gauss.measure();
  return row;
}

Errors of_finite(const Column<float>& values) {
  Errors sizes;
  for (const float value : values)
    if (std::isfinite(value)) sizes.add(value);
  return sizes;
}

Errors distances(const Column<glm::vec3>& found, const Column<glm::vec3>& right) {
  Errors apart;
  for (std::size_t i = 0; i < right.size(); i++) {
    const double distance = glm::length(glm::dvec3(found[i]) - glm::dvec3(right[i]));
    if (std::isfinite(distance)) apart.add(distance);
  }
  return apart;
}

}  // namespace

StreamComparison compare_stream(const Device& device, const Surface& surface, const StreamCompareOptions& options) {
  check(options);
  StreamOptions way = options_of(surface);
  way.method = StreamMethod::mesh;
  const auto by = [&](StreamDerivatives derivatives) {
    way.derivatives = derivatives;
    return Interrogator(device, with_options(surface, way));
  };
  std::size_t step = 0;
  const auto stepped = [&] {
    if (options.progress) options.progress(++step, std::size(compared) + 2);
  };

  StreamComparison result;
  result.rays = options.rays;
  result.tolerance = way.tolerance;
  const Interrogator integrated = by(StreamDerivatives::integrated);
  const HitList hits = integrated.cast(chords_of(surface.bounds(), options.rays, options.seed), {.hits = Hits::all});
  if (hits.size() == 0) {
    throw Error(ErrorCode::input, fmt::format("nothing to compare: of {} random chords of its bounds none meets the "
                                              "surface",
                                              options.rays));
  }
  result.hits = hits.size();
  for (const HitStatus status : hits.status()) result.sampled += status == HitStatus::sampled;
  const PointProperties right = integrated.properties_at(hits.coordinates(), curved);
  result.mean_rms = of_finite(right.mean).rms();
  result.gauss_rms = of_finite(right.gauss).rms();
  stepped();
  const std::vector<SurfaceCoordinates> places =
      random_places(seed_range(surface), way.time, options.places, options.seed);
  const auto location = std::uint32_t(Property::location);
  const PointProperties there = integrated.properties_at(places, location);
  stepped();
  for (const StreamDerivatives derivatives : compared) {
    const Interrogator query = by(derivatives);
    StreamComparisonRow& row =
        result.rows.emplace_back(compare_properties(query.properties_at(hits.coordinates(), curved), right));
    row.derivatives = derivatives;
    if (derivatives == StreamDerivatives::interpolated) {
      const Errors apart = distances(query.properties_at(places, location).location, there.location);
      result.deviation = apart.measure();
      result.places = apart.count;
    }
    stepped();
  }
  return result;
}

}  // namespace smurf
