#include "api/space_queries.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr int lattice_lines = 96;  // along the longest edge of the domain
constexpr std::size_t points_in_tile = 1 << 15;
constexpr std::size_t most_starts = 8;      // of a point
constexpr std::size_t most_samples = 4096;  // that a point looks at
constexpr double reach = 1.5;               // of a sample, in spacings
constexpr int newton_steps = 8;
constexpr int falling_steps = 22;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// A place on the surface on the way to the one that is nearest to a point.
struct Start {
  std::size_t point;
  glm::dvec3 target, place;
  double distance, step;  // the longest step that is tried
};

// What is tried for one of the starts: the surface along `normal` through `place`, up to `off` away from there.
struct Trial {
  std::size_t start;
  glm::dvec3 place, normal;
  double off;
};

// The surface points of trials that are nearest to their places; not finite where there is none.
std::vector<glm::dvec3> pulled(SurfaceQueries& queries, const std::vector<Trial>& trials) {
  RayBatch rays(trials.size());
  for (std::size_t i = 0; i < trials.size(); i++) {
    const Trial& trial = trials[i];
    rays.set(i,
             {glm::vec3(trial.place - trial.off * trial.normal), glm::vec3(trial.normal), 0.0f, float(2 * trial.off)});
  }
  HitList hits;
  queries.cast(rays, {.hits = Hits::all}, hits);
  std::vector<glm::dvec3> found(trials.size(), glm::dvec3(infinity));
  for (std::size_t i = 0; i < trials.size(); i++) {
    for (std::size_t h = hits.offsets()[i]; h < hits.offsets()[i + 1]; h++) {
      const glm::dvec3 hit(hits.locations()[h]);
      if (!(glm::distance(hit, trials[i].place) >= glm::distance(found[i], trials[i].place))) found[i] = hit;
    }
  }
  return found;
}

PointProperties measured(SurfaceQueries& queries, const std::vector<Start>& starts) {
  std::vector<glm::vec3> places;
  places.reserve(starts.size());
  for (const Start& start : starts) places.emplace_back(start.place);
  PointProperties values;
  queries.measure({places, {}, {}}, Property::normal | Property::principal | std::uint32_t(Property::directions), {},
                  values);
  return values;
}

// Goes to each start's best trial, if that is nearer; else its steps get shorter.
void take_best(SurfaceQueries& queries, const std::vector<Trial>& trials, std::vector<Start>& starts, double shorter) {
  const std::vector<glm::dvec3> found = pulled(queries, trials);
  std::vector<char> moved(starts.size(), 0);
  for (std::size_t i = 0; i < trials.size(); i++) {
    Start& start = starts[trials[i].start];
    const double distance = glm::distance(found[i], start.target);
    if (!(distance < start.distance)) continue;
    start.distance = distance;
    start.place = found[i];
    moved[trials[i].start] = 1;
  }
  for (std::size_t i = 0; i < starts.size(); i++) {
    if (moved[i] == 0) starts[i].step *= shorter;
  }
}

// With q = target - place, the square of the distance at a tangent step s is |q_t - s|² + (q·n) s·S s to second order,
// S = dn: the least is at s_i = q_i / (1 + (q·n) k_i) along the principal directions, where that is positive.
void newton_step(SurfaceQueries& queries, double rounding, std::vector<Start>& starts) {
  const PointProperties at = measured(queries, starts);
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < starts.size(); i++) {
    const Start& start = starts[i];
    const glm::dvec3 n(at.normal[i]), q = start.target - start.place;
    if (!is_finite(n)) continue;
    const double height = glm::dot(q, n);
    glm::dvec3 step(0.0);
    double bend = 0;
    const bool curved = is_finite(glm::dvec3(at.d1[i])) && std::isfinite(at.k1[i]) && std::isfinite(at.k2[i]);
    if (curved) {
      for (const auto& [d, k] : {std::pair(at.d1[i], at.k1[i]), std::pair(at.d2[i], at.k2[i])}) {
        const double along = glm::dot(q, glm::dvec3(d)), form = 1 + height * double(k);
        const double length = form > 0.1 ? along / form : along;
        step += length * glm::dvec3(d);
        bend += 0.5 * double(k) * length * length;
      }
    } else {
      step = q - height * n;
    }
    const double length = glm::length(step);
    if (length > start.step) {
      const double part = start.step / length;
      step *= part;
      bend *= part * part;
    }
    trials.push_back({i, start.place + step - bend * n, n, std::max(0.5 * std::min(length, start.step), rounding)});
  }
  take_best(queries, trials, starts, 0.25);
}

// Steps to four sides, shorter where none leads nearer.
void falling_step(SurfaceQueries& queries, double rounding, std::vector<Start>& starts) {
  const PointProperties at = measured(queries, starts);
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < starts.size(); i++) {
    const glm::dvec3 n(at.normal[i]);
    if (!is_finite(n)) continue;
    const glm::dvec3 axis = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(n, axis)), v = glm::cross(n, u);
    for (const glm::dvec3& side : {u, v, -u, -v})
      trials.push_back({i, starts[i].place + starts[i].step * side, n, std::max(starts[i].step, rounding)});
  }
  take_best(queries, trials, starts, 0.5);
}

// Only the best start of each point.
std::vector<Start> best_of(const std::vector<Start>& starts) {
  std::vector<Start> best;
  for (const Start& start : starts) {
    if (best.empty() || best.back().point != start.point) {
      best.push_back(start);
    } else if (start.distance < best.back().distance) {
      best.back() = start;
    }
  }
  return best;
}

// The samples that a point's search starts at: the nearest one, and others that are not next to it.
void add_starts(const KdTree& samples, double spacing, std::size_t point, const glm::dvec3& target,
                std::vector<Start>& starts) {
  const std::size_t first = starts.size();
  std::size_t seen = 0;
  samples.nearest_first(target, [&](const glm::vec3& sample, double distance) {
    if (starts.size() > first && distance > starts[first].distance + reach * spacing) return false;
    bool apart = true;
    for (std::size_t i = first; i < starts.size(); i++)
      apart = apart && glm::distance(starts[i].place, glm::dvec3(sample)) > 3 * spacing;
    if (apart) starts.push_back({point, target, glm::dvec3(sample), distance, 4 * spacing});
    return ++seen < most_samples && starts.size() < first + most_starts;
  });
}

}  // namespace

std::uint32_t SpaceQueries::needed(std::uint32_t wanted) const {
  std::uint32_t more = 0;
  if (contains(wanted, Property::distance) && model_->has_coordinates()) more = more | Property::location;
  if (contains(wanted, Property::inside) && model_->inside_of_level()) more = more | Property::value;
  return more;
}

void SpaceQueries::require_answerable(std::uint32_t wanted) const {
  if (!contains(wanted, Property::inside)) return;
  const std::string reason = model_->no_inside();
  if (!reason.empty()) throw Error(ErrorCode::usage, "the property inside is not known here: " + reason);
}

void SpaceQueries::answer(std::span<const glm::vec3> points, std::uint32_t wanted, PointProperties& values) {
  if (contains(wanted, Property::distance)) {
    if (model_->has_coordinates()) {
      Values<float> distance(points.size(), nan);
      for (std::size_t i = 0; i < points.size(); i++)
        distance[i] = float(glm::distance(glm::dvec3(points[i]), glm::dvec3(values.location[i])));
      values.distance = std::move(distance);
    } else {
      values.distance = distances(points);
    }
  }
  if (contains(wanted, Property::inside)) {
    if (const auto level = model_->inside_of_level()) {
      Values<float> inside(points.size(), nan);
      for (std::size_t i = 0; i < points.size(); i++) {
        const double above = double(values.value[i]) - level->level;
        if (!std::isnan(above)) inside[i] = (level->greater ? above > 0 : above < 0) ? 1.0f : 0.0f;
      }
      values.inside = std::move(inside);
    } else {
      values.inside = inside_closed(points);
    }
  }
}

void SpaceQueries::sample() {
  const Bounds bounds = model_->bounds();
  const glm::dvec3 extent = bounds.upper - bounds.lower;
  spacing_ = std::max({extent.x, extent.y, extent.z}) / lattice_lines;
  std::vector<Ray> rays;
  for (int axis = 0; axis < 3; axis++) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const int lines_u = std::max(int(std::ceil(extent[u] / spacing_)), 1),
              lines_v = std::max(int(std::ceil(extent[v] / spacing_)), 1);
    for (int j = 0; j < lines_v; j++) {
      for (int i = 0; i < lines_u; i++) {
        Ray ray;
        glm::dvec3 origin = bounds.lower, direction(0.0);
        origin[u] += extent[u] * (i + 0.5) / lines_u;
        origin[v] += extent[v] * (j + 0.5) / lines_v;
        origin[axis] -= 0.5 * spacing_;
        direction[axis] = 1;
        ray.origin = glm::vec3(origin);
        ray.direction = glm::vec3(direction);
        rays.push_back(ray);
      }
    }
  }
  HitList hits;
  queries_.cast(RayBatch(rays), {.hits = Hits::all}, hits);
  samples_.emplace(std::vector<glm::vec3>(hits.locations().begin(), hits.locations().end()));
}

Values<float> SpaceQueries::distances(std::span<const glm::vec3> points) {
  if (!samples_) sample();
  Values<float> distance(points.size(), nan);
  if (samples_->empty()) return distance;
  const Bounds bounds = model_->bounds();
  const double size = std::max(glm::length(bounds.lower), glm::length(bounds.upper)), rounding = 0x1p-19 * size;
  for (std::size_t first = 0; first < points.size(); first += points_in_tile) {
    const std::size_t count = std::min(points_in_tile, points.size() - first);
    std::vector<std::vector<Start>> of_points(count);
    parallel_for(count, [&](std::size_t i) {
      if (is_finite(glm::dvec3(points[first + i])))
        add_starts(*samples_, spacing_, first + i, glm::dvec3(points[first + i]), of_points[i]);
    });
    std::vector<Start> starts;
    for (const std::vector<Start>& some : of_points) starts.insert(starts.end(), some.begin(), some.end());
    if (starts.empty()) continue;
    for (int step = 0; step < newton_steps; step++) newton_step(queries_, rounding, starts);
    starts = best_of(starts);
    for (Start& start : starts) start.step = 0.25 * spacing_;
    for (int step = 0; step < falling_steps; step++) falling_step(queries_, rounding, starts);
    for (const Start& start : starts) distance[start.point] = float(start.distance);
  }
  return distance;
}

Values<float> SpaceQueries::inside_closed(std::span<const glm::vec3> points) {
  constexpr std::array<glm::vec3, 3> sides{glm::vec3(0.8311f, 0.4173f, 0.3679f), glm::vec3(-0.3517f, 0.7719f, -0.5297f),
                                           glm::vec3(-0.2839f, -0.4561f, 0.8434f)};
  Values<float> inside(points.size(), nan);
  const Bounds bounds = model_->bounds();
  std::vector<std::size_t> open;  // all others are outside of the bounds, or nowhere
  for (std::size_t i = 0; i < points.size(); i++) {
    const glm::dvec3 p(points[i]);
    if (!is_finite(p)) continue;
    inside[i] = 0;
    bool within = true;
    for (int axis = 0; axis < 3; axis++)
      within = within && p[axis] >= bounds.lower[axis] && p[axis] <= bounds.upper[axis];
    if (within) open.push_back(i);
  }
  RayBatch rays(sides.size() * open.size());
  for (std::size_t i = 0; i < open.size(); i++) {
    for (std::size_t k = 0; k < sides.size(); k++) {
      Ray ray;
      ray.origin = points[open[i]];
      ray.direction = sides[k];
      rays.set(sides.size() * i + k, ray);
    }
  }
  if (open.empty()) return inside;
  HitList hits;
  queries_.cast(rays, {.hits = Hits::count}, hits);
  for (std::size_t i = 0; i < open.size(); i++) {
    std::size_t odd = 0;
    for (std::size_t k = 0; k < sides.size(); k++) odd += hits.counts()[sides.size() * i + k] % 2;
    inside[open[i]] = 2 * odd > sides.size() ? 1.0f : 0.0f;
  }
  return inside;
}

}  // namespace smurf
