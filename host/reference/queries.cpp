#include "reference/queries.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"
#include "surfaces/hit_columns.hpp"
#include "surfaces/kinds.hpp"

namespace smurf {
namespace {

constexpr std::size_t default_tile = 16384;
constexpr std::size_t chunk = 64;  // rays or points that a thread takes at a time
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// The range [begin, end) of each tile, then progress.
template <class Work>
void for_tiles(std::size_t count, std::size_t tile, const std::function<void(std::size_t, std::size_t)>& progress,
               const Work& work) {
  if (tile == 0) tile = default_tile;
  for (std::size_t begin = 0; begin < count;) {
    const std::size_t end = begin + std::min(tile, count - begin);
    work(begin, end);
    if (progress) progress(end, count);
    begin = end;
  }
}

ReferenceRay in_double(const Ray& ray) {
  return {glm::dvec3(ray.origin), glm::dvec3(ray.direction), ray.t_min, ray.t_max};
}

}  // namespace

const char* fault_of(const Ray& ray) {
  if (!is_finite(ray.origin)) return "its origin is not finite";
  if (!is_finite(ray.direction)) return "its direction is not finite";
  if (ray.direction == glm::vec3(0.0f)) return "its direction is zero";
  if (!std::isfinite(ray.t_min)) return "its tmin is not finite";
  if (std::isnan(ray.t_max)) return "its tmax is not a number";
  if (ray.t_min > ray.t_max) return "its tmin is greater than its tmax";
  return nullptr;
}

void ReferenceQueries::cast(const RayBatch& rays, const CastOptions& options, HitList& hits) {
  HitColumns::clear(hits);
  const bool bare = only_counts(options.hits);
  auto& ray_status = HitColumns::ray_status(hits);
  auto &counts = HitColumns::counts(hits), &flagged = HitColumns::flagged(hits);
  if (bare) HitColumns::offsets(hits).clear();
  ray_status.assign(rays.size(), RayStatus::ok);
  for (std::size_t i = 0; i < rays.size(); i++) {
    const char* fault = fault_of(rays[i]);
    if (!fault) continue;
    if (options.bad_rays == BadRays::error)
      throw Error(ErrorCode::input, "ray " + std::to_string(i) + " is invalid: " + fault);
    ray_status[i] = RayStatus::invalid;
  }

  for_tiles(rays.size(), options.tile, options.progress, [&](std::size_t begin, std::size_t end) {
    std::vector<std::vector<ReferenceHit>> found(end - begin);
    parallel_for((end - begin + chunk - 1) / chunk, [&](std::size_t c) {
      for (std::size_t i = begin + c * chunk; i < std::min(end, begin + (c + 1) * chunk); i++) {
        if (ray_status[i] != RayStatus::ok) continue;
        std::vector<ReferenceHit>& row = found[i - begin];
        surface_->roots(in_double(rays[i]), options.hits == Hits::first || options.hits == Hits::any, row);
        if (options.hits == Hits::first && row.size() > 1) row.erase(row.begin() + 1, row.end());
      }
    });
    for (std::size_t i = begin; bare && i < end; i++) {
      const std::vector<ReferenceHit>& row = found[i - begin];
      const bool any = options.hits == Hits::any;
      const auto open = std::size_t(std::ranges::count_if(row, [](const ReferenceHit& hit) {
        return hit.status == HitStatus::tangent || hit.status == HitStatus::unresolved;
      }));
      counts.push_back(std::uint32_t(any ? std::min<std::size_t>(row.size(), 1) : row.size()));
      flagged.push_back(std::uint32_t(any && open < row.size() ? 0 : open));
    }
    for (std::size_t i = begin; !bare && i < end; i++) {
      const ReferenceRay ray = in_double(rays[i]);
      for (const ReferenceHit& hit : found[i - begin]) {
        const double t = std::clamp(hit.t, ray.t_min, ray.t_max);
        const float rounded = float(t);
        HitColumns::append(hits, surface_->has_coordinates(),
                           {.rays = std::uint32_t(i),
                            .t = rounded,
                            // Still an enclosure after rounding t, and the sum itself rounded up.
                            .uncertainty = std::nextafter(float(hit.uncertainty + std::abs(hit.t - rounded)), INFINITY),
                            .status = hit.status,
                            .locations = glm::vec3(ray.origin + t * ray.direction),
                            .coordinates = hit.coordinates});
      }
      HitColumns::offsets(hits).push_back(hits.size());
    }
  });

  if (bare) return count_flagged_rays(*this, rays, options, hits);
  if (options.properties != 0)
    measure({hits.locations(), hits.coordinates(), {}}, options.properties, {}, HitColumns::properties(hits));
}

void ReferenceQueries::measure(const PointSet& set, std::uint32_t wanted, const ProbeOptions& options,
                               PointProperties& out) {
  const std::span<const glm::vec3> points = set.locations, directions = set.directions;
  if (contains(wanted, Property::normal_curvature) && directions.size() != points.size()) {
    throw Error(ErrorCode::usage, "normal curvature needs one direction per point: there are " +
                                      std::to_string(points.size()) + " points and " +
                                      std::to_string(directions.size()) + " directions");
  }
  const auto column = [&](Property property, auto fill) {
    return Values<decltype(fill)>(contains(wanted, property) ? points.size() : 0, fill);
  };
  auto value = column(Property::value, nan), gauss = column(Property::gauss, nan), mean = column(Property::mean, nan),
       k1 = column(Property::principal, nan), k2 = column(Property::principal, nan),
       along = column(Property::normal_curvature, nan);
  auto normal = column(Property::normal, glm::vec3(nan)), d1 = column(Property::directions, glm::vec3(nan)),
       d2 = column(Property::directions, glm::vec3(nan)), location = column(Property::location, glm::vec3(nan));
  Values<std::uint32_t> status(points.size(), PointStatus::undefined);
  const bool located = contains(wanted, Property::parameters) && surface_->has_coordinates() && set.coordinates.empty();
  Values<SurfaceCoordinates> coordinates(located ? points.size() : 0);

  auto one = [&](std::size_t i) {
    const ReferencePoint point =
        surface_->measure(glm::dvec3(points[i]), set.coordinates.empty() ? nullptr : &set.coordinates[i]);
    const SurfaceFrame& frame = point.frame;
    status[i] = frame.status;
    if (!coordinates.empty()) coordinates[i] = point.coordinates;
    if (contains(wanted, Property::value)) value[i] = float(point.value);
    if (contains(wanted, Property::normal)) normal[i] = glm::vec3(frame.normal);
    if (contains(wanted, Property::location)) location[i] = glm::vec3(point.location);
    if (contains(wanted, Property::gauss)) gauss[i] = float(frame.k1 * frame.k2);
    if (contains(wanted, Property::mean)) mean[i] = float(0.5 * (frame.k1 + frame.k2));
    if (contains(wanted, Property::principal)) {
      k1[i] = float(frame.k1);
      k2[i] = float(frame.k2);
    }
    if (contains(wanted, Property::directions)) {
      d1[i] = glm::vec3(frame.d1);
      d2[i] = glm::vec3(frame.d2);
    }
    if (contains(wanted, Property::normal_curvature))
      along[i] = float(normal_curvature(frame, glm::dvec3(directions[i])));
  };
  for_tiles(points.size(), options.tile, options.progress, [&](std::size_t begin, std::size_t end) {
    parallel_for((end - begin + chunk - 1) / chunk, [&](std::size_t c) {
      for (std::size_t i = begin + c * chunk; i < std::min(end, begin + (c + 1) * chunk); i++) one(i);
    });
  });
  if (contains(wanted, Property::value)) out.value = std::move(value);
  if (contains(wanted, Property::normal)) out.normal = std::move(normal);
  if (contains(wanted, Property::gauss)) out.gauss = std::move(gauss);
  if (contains(wanted, Property::mean)) out.mean = std::move(mean);
  if (contains(wanted, Property::principal)) out.k1 = std::move(k1), out.k2 = std::move(k2);
  if (contains(wanted, Property::directions)) out.d1 = std::move(d1), out.d2 = std::move(d2);
  if (contains(wanted, Property::normal_curvature)) out.normal_curvature = std::move(along);
  if (contains(wanted, Property::location)) out.location = std::move(location);
  if (located) out.coordinates = std::move(coordinates);
  out.status = std::move(status);
  out.measured |= wanted;
}

ReferenceWalker ReferenceSurface::begin_walk(const glm::dvec3&, const SurfaceCoordinates*, const glm::dvec3&,
                                             double) const {
  throw Error(ErrorCode::usage, "surfaces of this kind cannot be walked on yet by the reference");
}

ReferenceWalker ReferenceSurface::neighbor(const ReferenceWalker&, double) const {
  throw Error(ErrorCode::usage, "surfaces of this kind cannot be walked on yet by the reference");
}

void ReferenceQueries::walk(const WalkStart& start, const WalkOptions& options, const WalkSink& sink) {
  const PointSet& set = start.points;
  std::size_t done = 0;
  const std::size_t size = set.locations.size();
  for_tiles(size, options.tile, {}, [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<ReferenceWalker> walkers(count);
    Values<glm::vec3> locations(count), normals(count), directions(count);
    Values<SurfaceCoordinates> coordinates(count);
    Values<float> chords(count);
    Values<WalkStatus> status(count);
    const auto one = [&](std::size_t i, int step) {
      const std::size_t point = begin + i;
      ReferenceWalker& walker = walkers[i];
      const float distance = start.distances[start.distances.size() == 1 ? 0 : point];
      if (step == 0) {
        const bool sane = is_finite(set.locations[point]) && is_finite(set.directions[point]);
        if (sane)
          walker = surface_->begin_walk(glm::dvec3(set.locations[point]),
                                        set.coordinates.empty() ? nullptr : &set.coordinates[point],
                                        glm::dvec3(set.directions[point]), double(options.tolerance));
        else walker = {.location = glm::dvec3(set.locations[point]), .status = WalkStatus::invalid};
      } else if (goes_on(walker.status)) {
        if (std::isfinite(distance) && distance > 0) walker = surface_->neighbor(walker, double(distance));
        else walker.status = WalkStatus::invalid, walker.chord = 0;
      }
      locations[i] = glm::vec3(walker.location);
      normals[i] = walker.normal == glm::dvec3(0.0) ? glm::vec3(nan) : glm::vec3(walker.normal);
      directions[i] = walker.direction == glm::dvec3(0.0) ? glm::vec3(nan) : glm::vec3(walker.direction);
      coordinates[i] = {walker.part, float(walker.u), float(walker.v)};
      chords[i] = float(walker.chord);
      status[i] = walker.status;
    };
    for (int step = 0; step <= start.steps; step++) {
      parallel_for((count + chunk - 1) / chunk, [&](std::size_t c) {
        for (std::size_t i = c * chunk; i < std::min(count, (c + 1) * chunk); i++) one(i, step);
      });
      if (step == 0 && !start.tell_start) continue;
      sink({begin, step, locations, normals, directions, coordinates, chords, status});
      if (step > 0) done += count;
      if (options.progress && step > 0) options.progress(done, size * std::size_t(start.steps));
    }
  });
}

void ReferenceQueries::update(const std::shared_ptr<const SurfaceDefinition>& model) {
  std::shared_ptr<const ReferenceSurface> next = surface_->updated(*model);
  surface_ = next ? std::move(next) : refer(*model);
}

std::unique_ptr<SurfaceQueries> interrogate_by_reference(const SurfaceDefinition& definition) {
  return std::make_unique<ReferenceQueries>(refer(definition));
}

}  // namespace smurf
