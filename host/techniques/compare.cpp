// Compares reconstructions with the exact surface, by two batches of rays that are the same for all of them.
//
// Chords of the domain find the exact surface, and count roots that a reconstruction misses or invents. As chords are
// isotropic lines, their roots are spread evenly over the surface (Crofton). Errors are not measured along the chords,
// where a root moves by the distance of the surfaces divided by the cosine of the angle to the normal: its mean square
// over all chords has no bound, and would hide the order. They are measured along short rays through the exact roots in
// the direction of the exact normals. Of those the exact location, normal and curvature are known once for all, and t,
// being small, loses little to rounding.
#include "smurf/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "techniques/errors.hpp"

namespace smurf {

namespace {

constexpr int most_nodes = 1290;  // 1290³ are the most samples that a volume takes
constexpr int greatest_apron = 100;
constexpr std::uint32_t measured = Property::normal | Property::mean | std::uint32_t(Property::gauss);

double length_of(const glm::dvec3& v) { return std::sqrt(glm::dot(v, v)); }

double longest(const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); }

glm::dvec3 extent_of(const Domain& domain) { return domain.upper - domain.lower; }

// The domain less the margin.
class Interior {
 public:
  Interior(const Domain& domain, double margin)
      : lower_(domain.lower + margin), upper_(domain.upper - margin), radius_(domain.radius - margin) {
    is_ball_ = domain.radius > 0;
  }
  bool is_empty() const { return glm::any(glm::greaterThanEqual(lower_, upper_)) || (is_ball_ && !(radius_ > 0)); }
  bool contains(const glm::dvec3& p) const {
    return glm::all(glm::lessThanEqual(lower_, p)) && glm::all(glm::lessThanEqual(p, upper_)) &&
           (!is_ball_ || length_of(p) <= radius_);
  }

 private:
  glm::dvec3 lower_, upper_;
  double radius_;
  bool is_ball_;
};

struct Rows {
  std::size_t begin, end;
};

Rows rows_of(const HitList& hits, std::size_t ray) {
  return {std::size_t(hits.offsets()[ray]), std::size_t(hits.offsets()[ray + 1])};
}

// The hit of a ray whose t is nearest; hits.size() where there is none within `reach`.
std::size_t nearest_hit(const HitList& hits, std::size_t ray, double t, double reach) {
  std::size_t best = hits.size();
  const Rows rows = rows_of(hits, ray);
  for (std::size_t i = rows.begin; i < rows.end; i++) {
    const double distance = std::abs(double(hits.t()[i]) - t);
    if (distance > reach) continue;
    best = i;
    reach = distance;
  }
  return best;
}

// A ray's properties at a point of the exact surface.
struct ExactPoint {
  double t;  // on the ray along the normal
  glm::dvec3 normal;
  double mean, gauss;
};

// What is known of the exact surface.
struct Truth {
  RayBatch chords, normals;  // the latter one to each point
  HitList hits;              // of the chords
  std::vector<ExactPoint> points;
};

class Work {
 public:
  Work(const Device& device, const Surface& surface, const CompareOptions& options)
      : device_(device), surface_(surface), options_(options) {
    const std::size_t rows = options.resolutions.size() * options.reconstructions.size();
    steps_ = 2 * (rows + 1);  // two batches to each surface
    result_.rows.resize(rows);
  }

  Comparison run();

 private:
  void find_points(const Interior& interior);
  ComparisonRow compare_surface(const Interrogator& query, const Interior& interior);
  void compare_points(const HitList& hits, ComparisonRow& row) const;
  void compare_chord(const HitList& hits, std::size_t ray, const Interior& interior, ComparisonRow& row,
                     Errors& along) const;
  HitList cast(const Interrogator& query, const RayBatch& rays, std::uint32_t properties);
  HitList cast_on_device(const Interrogator& query, const RayBatch& rays, std::uint32_t properties);

  const Device& device_;
  const Surface& surface_;
  const CompareOptions& options_;
  std::size_t step_ = 0, steps_ = 0;
  Truth truth_;
  Comparison result_;
};

HitList Work::cast(const Interrogator& query, const RayBatch& rays, std::uint32_t properties) {
  CastOptions options{.hits = Hits::all, .properties = properties};
  if (options_.progress) {
    options.progress = [this](std::size_t done, std::size_t total) {
      constexpr std::size_t parts = 1000;
      options_.progress(parts * step_ + parts * done / std::max<std::size_t>(total, 1), parts * steps_);
    };
  }
  HitList hits = query.cast(rays, options);
  step_++;
  return hits;
}

HitList Work::cast_on_device(const Interrogator& query, const RayBatch& rays, std::uint32_t properties) {
  const auto start = std::chrono::steady_clock::now();
  HitList hits = cast(query, rays, properties);
  result_.device_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result_.device_rays += rays.size();
  return hits;
}

// The exact roots of the chords, and from those the points with rays along their normals.
void Work::find_points(const Interior& interior) {
  const Interrogator exact(open_device("reference"), surface_);
  truth_.hits = cast(exact, truth_.chords, std::uint32_t(Property::normal));
  const HitList& hits = truth_.hits;
  const double reach = result_.reach;
  std::vector<Ray> along;
  for (std::size_t i = 0; i < hits.size(); i++) {
    const glm::dvec3 point(hits.locations()[i]), normal(hits.normals()[i]);
    if (!interior.contains(point)) {
      result_.near_boundary++;
      continue;
    }
    result_.roots++;
    if (hits.status()[i] != HitStatus::isolated || !std::isfinite(normal.x)) continue;
    along.push_back({glm::vec3(point - reach * normal), glm::vec3(normal), 0.0f, float(2 * reach)});
  }

  const HitList centres = cast(exact, RayBatch(along), measured);
  std::vector<Ray> kept;
  Errors means, gausses;
  for (std::size_t i = 0; i < along.size(); i++) {
    // The root that the ray was laid through: other than by rounding it is not elsewhere.
    const std::size_t hit = nearest_hit(centres, i, reach, 1e-3 * reach);
    if (hit == centres.size() || centres.status()[hit] != HitStatus::isolated) continue;
    const double mean = centres.mean_curvatures()[hit], gauss = centres.gauss_curvatures()[hit];
    if (!std::isfinite(mean) || !std::isfinite(gauss)) continue;
    truth_.points.push_back({centres.t()[hit], glm::dvec3(centres.normals()[hit]), mean, gauss});
    kept.push_back(along[i]);
    means.add(mean);
    gausses.add(gauss);
  }
  truth_.normals = RayBatch(kept);
  result_.points = kept.size();
  result_.singular = result_.roots - result_.points;
  result_.mean_rms = means.rms();
  result_.gauss_rms = gausses.rms();
}

void Work::compare_points(const HitList& hits, ComparisonRow& row) const {
  Errors location, normal, mean, gauss;
  for (std::size_t i = 0; i < truth_.points.size(); i++) {
    const ExactPoint& point = truth_.points[i];
    const std::size_t hit = nearest_hit(hits, i, point.t, result_.reach);
    if (hit == hits.size()) {
      row.lost++;
      continue;
    }
    location.add((double(hits.t()[hit]) - point.t) * length_of(glm::dvec3(truth_.normals[i].direction)));
    const glm::dvec3 n(hits.normals()[hit]);
    const double h = hits.mean_curvatures()[hit], k = hits.gauss_curvatures()[hit];
    if (!std::isfinite(n.x) || !std::isfinite(h) || !std::isfinite(k)) {
      row.undefined++;
      continue;
    }
    normal.add(angle_between(n, point.normal));
    mean.add(h - point.mean);
    gauss.add(k - point.gauss);
  }
  row.location = location.measure();
  row.normal = normal.measure();
  row.mean = mean.measure();
  row.gauss = gauss.measure();
}

// Both lists are sorted. Roots within reach of each other are counterparts, unless the next root of one of the lists is
// nearer.
void Work::compare_chord(const HitList& hits, std::size_t ray, const Interior& interior, ComparisonRow& row,
                         Errors& along) const {
  const HitList& exact = truth_.hits;
  const Rows theirs = rows_of(exact, ray), ours = rows_of(hits, ray);
  const double unit = length_of(glm::dvec3(truth_.chords[ray].direction)), reach = result_.reach / unit;
  const auto is_flagged = [&](const HitList& list, const Rows& rows, double t) {
    for (std::size_t i = rows.begin; i < rows.end; i++) {
      if (list.status()[i] != HitStatus::isolated &&
          std::abs(double(list.t()[i]) - t) <= double(list.uncertainty()[i]) + reach)
        return true;
    }
    return false;
  };
  const auto unmatched = [&](const HitList& list, std::size_t i, std::size_t& counter) {
    if (!interior.contains(glm::dvec3(list.locations()[i]))) return;
    const double t = list.t()[i];
    (is_flagged(exact, theirs, t) || is_flagged(hits, ours, t) ? row.undecided : counter)++;
  };

  const auto distance = [&](std::size_t e, std::size_t h) {
    return e < theirs.end && h < ours.end ? std::abs(double(exact.t()[e]) - double(hits.t()[h])) : INFINITY;
  };
  std::size_t e = theirs.begin, h = ours.begin;
  while (e < theirs.end || h < ours.end) {
    const double here = distance(e, h);
    const bool exact_is_first = h == ours.end || (e < theirs.end && exact.t()[e] < hits.t()[h]);
    if (here > reach) {
      exact_is_first ? unmatched(exact, e++, row.missed) : unmatched(hits, h++, row.invented);
    } else if (exact_is_first && distance(e + 1, h) < here) {
      unmatched(exact, e++, row.missed);
    } else if (!exact_is_first && distance(e, h + 1) < here) {
      unmatched(hits, h++, row.invented);
    } else {
      if (interior.contains(glm::dvec3(exact.locations()[e]))) along.add(here * unit);
      e++;
      h++;
    }
  }
}

ComparisonRow Work::compare_surface(const Interrogator& query, const Interior& interior) {
  ComparisonRow row;
  compare_points(cast_on_device(query, truth_.normals, measured), row);
  const HitList hits = cast_on_device(query, truth_.chords, 0);
  Errors along;
  for (std::size_t ray = 0; ray < truth_.chords.size(); ray++) compare_chord(hits, ray, interior, row, along);
  row.along_chord = along.measure();
  return row;
}

void set_orders(const ComparisonRow& coarser, ComparisonRow& row) {
  for (ErrorMeasure ComparisonRow::*measure : {&ComparisonRow::location, &ComparisonRow::normal, &ComparisonRow::mean,
                                               &ComparisonRow::gauss, &ComparisonRow::along_chord}) {
    const double ratio = (coarser.*measure).rms / (row.*measure).rms;
    if (ratio > 0 && std::isfinite(ratio)) (row.*measure).order = std::log(ratio) / std::log(coarser.step / row.step);
  }
}

Comparison Work::run() {
  const std::vector<int>& resolutions = options_.resolutions;
  const std::size_t reconstructions = options_.reconstructions.size();
  const Domain domain = sample_field(surface_, glm::ivec3(2)).domain;
  const glm::dvec3 extent = extent_of(domain);
  const double shortest = std::min({extent.x, extent.y, extent.z});
  result_.reach = longest(extent) / (resolutions.front() - 1);
  result_.margin = options_.margin.value_or(std::min(result_.reach, shortest / 8));
  result_.rays = options_.rays;
  result_.apron = options_.apron;
  const Interior interior(domain, result_.margin);
  if (interior.is_empty()) {
    throw Error(ErrorCode::usage, fmt::format("a margin of {} leaves nothing of a domain whose shortest edge is {}",
                                              result_.margin, shortest));
  }

  truth_.chords = chords_of({domain.lower, domain.upper}, options_.rays, options_.seed);
  find_points(interior);
  if (result_.points == 0) {
    throw Error(ErrorCode::input,
                fmt::format("nothing to compare: of {} random chords none meets the surface farther than {:g} "
                            "from the border of its domain",
                            options_.rays, result_.margin));
  }
  for (std::size_t i = 0; i < resolutions.size(); i++) {
    const SampledField field = sample_field(surface_, glm::ivec3(resolutions[i]), options_.apron);
    for (std::size_t r = 0; r < reconstructions; r++) {
      const Reconstruction reconstruction = options_.reconstructions[r];
      const Interrogator query(device_, isosurface(field.volume, field.isovalue, {.reconstruction = reconstruction}));
      const std::size_t at = r * resolutions.size() + i;
      ComparisonRow& row = result_.rows[at];
      row = compare_surface(query, interior);
      row.reconstruction = reconstruction;
      row.resolution = resolutions[i];
      row.not_finite = field.volume.non_finite();
      row.step = longest(extent) / (resolutions[i] - 1);
      if (i > 0) set_orders(result_.rows[at - 1], row);
    }
  }
  return std::move(result_);
}

void check(const CompareOptions& options) {
  if (options.reconstructions.empty()) throw Error(ErrorCode::usage, "the list of reconstructions is empty");
  if (options.resolutions.empty()) throw Error(ErrorCode::usage, "the list of resolutions is empty");
  if (options.apron < 0 || options.apron > greatest_apron) {
    throw Error(ErrorCode::usage,
                fmt::format("the apron is from 0 to {} nodes, not {}", greatest_apron, options.apron));
  }
  const int finest = most_nodes - 2 * options.apron;
  int before = 1;
  for (const int resolution : options.resolutions) {
    if (resolution < 2 || resolution > finest) {
      throw Error(ErrorCode::usage,
                  fmt::format("resolutions are from 2 to {} nodes along each axis, not {}", finest, resolution));
    }
    if (resolution <= before) {
      throw Error(ErrorCode::usage, fmt::format("resolutions must ascend: {} follows on {}", resolution, before));
    }
    before = resolution;
  }
  if (options.rays == 0) throw Error(ErrorCode::usage, "at least one ray is needed for a comparison");
  if (options.margin && !(*options.margin >= 0 && std::isfinite(*options.margin)))
    throw Error(ErrorCode::usage, fmt::format("the margin must be a length, 0 or greater, not {}", *options.margin));
}

}  // namespace

Comparison compare(const Device& device, const Surface& surface, const CompareOptions& options) {
  check(options);
  return Work(device, surface, options).run();
}

}  // namespace smurf
