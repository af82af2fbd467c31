#include "api/resolve_hits.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

using expression::LineRoot;

constexpr float infinity = std::numeric_limits<float>::infinity();

// What t of a hit has been rounded by, in parts of the farthest t on the ray: it is the sum of where the ray enters and
// of how far the hit is from there, and the traversal in between rounds once or twice more.
constexpr double rounding_of_t = 0x1p-22;

constexpr std::size_t few_rays = 8;  // not worth a thread
constexpr int most_rounds = 100;     // of casting a ray again

double farthest_t(const Bounds& bounds, const Ray& ray) {
  double enter = ray.t_min, leave = ray.t_max;
  for (int axis = 0; axis < 3; axis++) {
    if (ray.direction[axis] == 0) continue;
    const double a = (bounds.lower[axis] - double(ray.origin[axis])) / double(ray.direction[axis]);
    const double b = (bounds.upper[axis] - double(ray.origin[axis])) / double(ray.direction[axis]);
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return std::max(std::abs(enter), std::abs(leave));
}

// The greatest float that is not above.
float float_below(double v) {
  const float rounded = float(v);
  return double(rounded) > v ? std::nextafter(rounded, -infinity) : rounded;
}

void each_ray(std::size_t count, const std::function<void(std::size_t)>& task) {
  if (count > few_rays) return parallel_for(count, task);
  for (std::size_t i = 0; i < count; i++) task(i);
}

bool is_flagged(HitStatus status) { return status == HitStatus::tangent || status == HitStatus::unresolved; }

// Rows that move together.
struct Stretch {
  std::size_t from, to, count;
};

// Moves stretches, which stand in order and do not overlap, neither before nor after. Those that move down go first,
// from the first one on, and then, from the last one on, those that move up: so none falls on rows that have yet to
// move.
template <class T>
void move_rows(const std::vector<Stretch>& stretches, T* rows) {
  const auto move = [&](const Stretch& s) { std::memmove(rows + s.to, rows + s.from, s.count * sizeof(T)); };
  for (const Stretch& s : stretches) {
    if (s.to < s.from) move(s);
  }
  for (auto s = stretches.rbegin(); s != stretches.rend(); ++s) {
    if (s->to > s->from) move(*s);
  }
}

}  // namespace

FlaggedHitResolver::Hit FlaggedHitResolver::hit_at(const HitList& hits, std::size_t row) {
  return {hits.t()[row], hits.uncertainty()[row], hits.status()[row],
          hits.coordinates().empty() ? SurfaceCoordinates{} : hits.coordinates()[row]};
}

void FlaggedHitResolver::resolve(const SurfaceDefinition& model, const RayBatch& rays, Hits wanted,
                                 const Cast& cast_first, HitList& hits) {
  if (std::ranges::none_of(hits.status(), is_flagged)) return;
  const RootResolver resolver = model.root_resolver();
  if (!resolver) return;
  std::vector<RayHits> flagged = flagged_rays(hits);
  const Bounds bounds = model.bounds();
  each_ray(flagged.size(),
           [&](std::size_t i) { resolve_ray(resolver, bounds, rays[flagged[i].ray], wanted, flagged[i]); });
  if (wanted == Hits::first) cast_again(resolver, bounds, rays, cast_first, flagged);
  write(flagged, rays, model.has_coordinates(), hits);
}

std::vector<FlaggedHitResolver::RayHits> FlaggedHitResolver::flagged_rays(const HitList& hits) {
  std::vector<RayHits> flagged;
  for (std::size_t h = 0; h < hits.size(); h++) {
    if (!is_flagged(hits.status()[h])) continue;
    const std::size_t ray = hits.rays()[h];
    if (!flagged.empty() && flagged.back().ray == ray) continue;
    flagged.push_back({ray, {}, {}});
    for (std::size_t i = hits.offsets()[ray]; i < hits.offsets()[ray + 1]; i++)
      flagged.back().hits.push_back(hit_at(hits, i));
  }
  return flagged;
}

void FlaggedHitResolver::resolve_ray(const RootResolver& resolver, const Bounds& bounds, const Ray& ray, Hits wanted,
                                     RayHits& ray_hits) {
  const double rounding = rounding_of_t * farthest_t(bounds, ray);
  const auto low_end = [&](const Hit& hit) { return double(hit.t) - double(hit.uncertainty) - rounding; };
  const auto high_end = [&](const Hit& hit) { return double(hit.t) + double(hit.uncertainty) + rounding; };
  std::vector<Hit> before = std::move(ray_hits.hits);
  ray_hits.hits.clear();
  ray_hits.again.reset();
  std::ranges::stable_sort(before, {}, low_end);
  std::vector<ResolvedRoot> roots;
  for (std::size_t first = 0, next; first < before.size(); first = next) {
    // The hits from `first` to `next` overlap.
    const double low = low_end(before[first]);
    double high = high_end(before[first]);
    for (next = first + 1; next < before.size() && low_end(before[next]) <= high; next++)
      high = std::max(high, high_end(before[next]));
    const auto stretch = std::span(before).subspan(first, next - first);
    if (std::ranges::none_of(stretch, is_flagged, &Hit::status)) {
      ray_hits.hits.insert(ray_hits.hits.end(), stretch.begin(), stretch.end());
      continue;
    }
    roots.clear();
    resolver(ray, std::max(low, double(ray.t_min)), std::min(high, double(ray.t_max)), roots);
    for (const auto& [root, coordinates, of_one] : roots) {
      const float t = std::clamp(float(0.5 * root.low + 0.5 * root.high), ray.t_min, ray.t_max);
      const double off = std::max(root.high - double(t), double(t) - root.low);
      ray_hits.hits.push_back({t, std::nextafter(float(off), infinity),
                               root.kind == LineRoot::Kind::one        ? of_one
                               : root.kind == LineRoot::Kind::touching ? HitStatus::tangent
                                                                       : HitStatus::unresolved,
                               coordinates});
    }
    if (wanted == Hits::first && ray_hits.hits.empty() && high < double(ray.t_max))
      ray_hits.again = std::max(float_below(high), std::nextafter(ray.t_min, infinity));
  }
  std::ranges::stable_sort(ray_hits.hits, {}, &Hit::t);
  if (wanted == Hits::first && ray_hits.hits.size() > 1)
    ray_hits.hits.erase(ray_hits.hits.begin() + 1, ray_hits.hits.end());
}

void FlaggedHitResolver::cast_again(const RootResolver& resolver, const Bounds& bounds, const RayBatch& rays,
                                    const Cast& cast_first, std::vector<RayHits>& all) {
  for (int round = 0; round < most_rounds; round++) {
    std::vector<RayHits*> open;
    for (RayHits& ray_hits : all) {
      if (ray_hits.again) open.push_back(&ray_hits);
    }
    if (open.empty()) return;
    RayBatch rest(open.size());
    for (std::size_t i = 0; i < open.size(); i++) {
      Ray ray = rays[open[i]->ray];
      ray.t_min = *open[i]->again;
      rest.set(i, ray);
    }
    HitList hits;
    cast_first(rest, hits);
    each_ray(open.size(), [&](std::size_t i) {
      RayHits& ray_hits = *open[i];
      ray_hits.again.reset();
      const std::size_t h = hits.offsets()[i];
      if (h == hits.offsets()[i + 1]) return;
      ray_hits.hits = {hit_at(hits, h)};
      // The last time a flag stays: it says that there may be no root.
      if (is_flagged(hits.status()[h]) && round + 1 < most_rounds)
        resolve_ray(resolver, bounds, rest[i], Hits::first, ray_hits);
    });
  }
}

// Puts the changed rays' hits in place of those that they had. The rows in between stay in the list's memory: they only
// move up or down by what the rays before them have lost or won.
void FlaggedHitResolver::write(const std::vector<RayHits>& changed, const RayBatch& rays, bool coordinates,
                               HitList& hits) {
  const std::size_t rows = hits.size();
  std::vector<Stretch> stretches;      // between the changed rays, where rows move at all
  std::vector<std::size_t> first_row;  // of each changed ray
  std::vector<std::uint64_t> won;      // by the rays up to each changed one, and it; wraps around where they have lost
  std::uint64_t moved = 0;
  std::size_t from = 0;
  const auto keep = [&](std::size_t end) {
    if (moved != 0 && end > from) stretches.push_back({from, std::size_t(from + moved), end - from});
  };
  for (const RayHits& r : changed) {
    keep(hits.offsets()[r.ray]);
    first_row.push_back(std::size_t(hits.offsets()[r.ray] + moved));
    from = hits.offsets()[r.ray + 1];
    moved += r.hits.size() - (hits.offsets()[r.ray + 1] - hits.offsets()[r.ray]);
    won.push_back(moved);
  }
  keep(rows);
  const auto total = std::size_t(rows + moved);

  const auto move_offsets = [&] {
    auto& offsets = HitColumns::offsets(hits);
    for (std::size_t i = 0; i < changed.size(); i++) {
      const std::size_t end = i + 1 < changed.size() ? changed[i + 1].ray : offsets.size() - 1;
      for (std::size_t ray = changed[i].ray + 1; ray <= end; ray++) offsets[ray] += won[i];
    }
  };
  std::vector<std::function<void()>> moves{move_offsets};
  HitColumns::each(hits, coordinates, [&](auto& column, auto) {
    moves.push_back([&] {
      column.resize(std::max(rows, total));
      move_rows(stretches, column.data());
      column.resize(total);
    });
  });
  if (std::ranges::any_of(won, [](std::uint64_t w) { return w != 0; }))
    parallel_for(moves.size(), [&](std::size_t i) { moves[i](); });

  for (std::size_t i = 0; i < changed.size(); i++) {
    const std::size_t ray_index = changed[i].ray;
    const Ray ray = rays[ray_index];
    std::size_t row = first_row[i];
    for (const Hit& hit : changed[i].hits) {
      const glm::vec3 location(glm::dvec3(ray.origin) + double(hit.t) * glm::dvec3(ray.direction));
      HitColumns::set(hits, coordinates, row++,
                      {.rays = std::uint32_t(ray_index),
                       .t = hit.t,
                       .uncertainty = hit.uncertainty,
                       .status = hit.status,
                       .locations = location,
                       .coordinates = hit.coordinates});
    }
  }
}

}  // namespace smurf
