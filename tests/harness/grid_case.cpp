#include "harness/grid_case.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <map>
#include <random>

#include "harness/replay.hpp"
#include "harness/tolerances.hpp"
#include "truth/jet.hpp"

namespace smurf::test {
namespace {

constexpr std::string_view kind = "isosurface";

// The largest magnitude of a sample: a unit of rounding of the field is 2^-24 of it.
double magnitude_of(const Volume& volume) { return std::max(std::abs(volume.minimum()), std::abs(volume.maximum())); }

template <class T>
bool same(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

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

// The first hits are the first of all hits.
void expect_first(const HitList& all, const HitList& first, const std::string& where) {
  ASSERT_EQ(first.ray_count(), all.ray_count()) << where;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < all.ray_count(); i++) {
    const std::size_t a = all.offsets()[i], f = first.offsets()[i];
    const bool some = all.offsets()[i + 1] > a;
    const std::size_t count = first.offsets()[i + 1] - f;
    if (count != (some ? 1u : 0u) || (some && (first.t()[f] != all.t()[a] || first.status()[f] != all.status()[a])))
      wrong++;
  }
  EXPECT_EQ(wrong, 0u) << where << ": rays whose first hit is not the first of all hits";
}

// Runs, tiles and first hits, on chords and on the pixels of cameras; and properties of what was hit.
void expect_steadiness(const GridCase& c, const std::shared_ptr<const GridField>& field,
                       std::span<const RayFamily> families, TestDevice& device, const Interrogator& query) {
  for (const RayFamily& family : families) {
    if (!family.random) continue;
    const std::string where = fmt::format("{}, {}, on {}", c.name, family.name, device.label);
    const RayBatch rays = first_rays(family.rays, device.slow ? 512 : 8192);
    const HitList all = query.cast(rays, {.hits = Hits::all});
    EXPECT_TRUE(same_bytes(all, query.cast(rays, {.hits = Hits::all}))) << where << ": two runs differ";
    EXPECT_TRUE(same_bytes(all, query.cast(rays, {.hits = Hits::all, .tile = 1000})))
        << where << ": the tile's size shows";
    expect_first(all, query.cast(rays, {.hits = Hits::first}), where);
    expect_properties(c, jets_of(field), all, where);
  }
}

}  // namespace

Judging judging_of(const GridCase& c) {
  return {.t_tolerance = tolerance(Quantity::t, kind).value,
          .value_tolerance = tolerance(Quantity::conditioning, kind).value * 0x1p-24 *
                             std::max(magnitude_of(c.volume), std::abs(c.isovalue))};
}

JetAt jets_of(const std::shared_ptr<const GridField>& field) {
  return [field](const glm::dvec3& point) -> std::optional<Jet> {
    const auto jet = field->jet(point);
    if (!jet) return {};
    return Jet{jet->value, jet->gradient, jet->hessian};
  };
}

bool same_bytes(const HitList& a, const HitList& b) {
  return same(a.offsets(), b.offsets()) && same(a.rays(), b.rays()) && same(a.t(), b.t()) &&
         same(a.uncertainty(), b.uncertainty()) && same(a.status(), b.status()) &&
         same(a.ray_status(), b.ray_status()) && same(a.locations(), b.locations());
}

RayBatch first_rays(const RayBatch& rays, std::size_t count) {
  if (rays.image_width) count = (count + rays.image_width - 1) / rays.image_width * rays.image_width;
  count = std::min(count, rays.size());
  RayBatch out(count);
  out.image_width = rays.image_width;
  for (std::size_t i = 0; i < count; i++) out.set(i, rays[i]);
  return out;
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

Judged expect_hits(const GridCase& c, const std::shared_ptr<const GridField>& field, const RayFamily& family,
                   const Truth& truth, TestDevice& device, const Interrogator& query, const Judged* known) {
  const std::string where = fmt::format("{}, {}, on {}", c.name, family.name, device.label);
  const RayBatch rays = device.slow ? first_rays(family.rays, family.rays.size() / c.slow_share + 16) : family.rays;
  const HitList hits = query.cast(rays, {.hits = Hits::all});
  EXPECT_EQ(hits.ray_count(), rays.size()) << where;
  if (hits.ray_count() != rays.size()) return {};
  if (known && same_bytes(hits, known->hits)) return *known;

  if (!family.valid) {
    EXPECT_EQ(hits.size(), 0u) << where << ": invalid rays have no hits";
    EXPECT_EQ(std::ranges::count(hits.ray_status(), RayStatus::invalid), std::ptrdiff_t(rays.size())) << where;
    return {hits, {}};
  }
  const Verdict verdict = judge(hits, truth, *field, c.isovalue, rays, judging_of(c));
  if (verdict.failures() > 0) {
    ADD_FAILURE() << where << ": " << verdict.summary() << "\n  worst: ray " << verdict.worst_ray << ": "
                  << verdict.worst << "\n  replay: "
                  << replay_command(c.name + " " + family.name, c.volume, c.isovalue, c.reconstruction,
                                    rays[verdict.worst_ray], device.name);
  }
  return {hits, verdict};
}

void expect_properties(const GridCase& c, const JetAt& jet_at, const HitList& hits, const std::string& where) {
  if (hits.size() == 0) return;
  std::mt19937 random(c.seed);
  std::normal_distribution<float> normal;
  std::vector<glm::vec3> directions(hits.size());
  for (glm::vec3& d : directions) d = glm::vec3(normal(random), normal(random), normal(random));
  const auto normals = hits.normals(), first = hits.first_principal_directions(),
             second = hits.second_principal_directions();
  const auto gauss = hits.gauss_curvatures(), mean = hits.mean_curvatures();
  const auto principal = hits.principal_curvatures();
  const auto along = hits.normal_curvatures(directions);
  const auto status = hits.point_status();

  const double magnitude = magnitude_of(c.volume);
  const double rounding = 0x1p-24 * magnitude;
  const glm::dmat3 axes = c.volume.placement().axes, to_index = glm::inverse(axes);
  // The voxel that curvature is measured by.
  const double step = std::min({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
  std::map<std::string, std::pair<double, std::size_t>> worst;  // error over tolerance, and where
  std::size_t compared = 0;
  const auto check = [&](const char* what, std::size_t i, double error, double allowed) {
    auto& [largest, at] = worst[what];
    const double ratio = std::isnan(error) ? HUGE_VAL : error / allowed;
    if (ratio > largest) largest = ratio, at = i;
  };

  for (std::size_t i = 0; i < std::min(hits.size(), c.properties); i++) {
    // Derivatives that jump at cell faces are not compared on them: the point's rounding decides the side.
    const glm::dvec3 point(hits.locations()[i]), index = to_index * (point - c.volume.placement().origin);
    const glm::dvec3 off_face = glm::abs(index - glm::round(index));
    if (c.reconstruction != Reconstruction::tricubic && std::min({off_face.x, off_face.y, off_face.z}) < 1e-3) continue;
    const auto jet = jet_at(point);
    if (!jet || jet->gradient == glm::dvec3(0.0)) continue;
    const double slope = glm::length(jet->gradient) * step;
    const Differential exact = differential_of(*jet);
    const double bend = std::max(std::abs(exact.k1), std::abs(exact.k2));
    const double scale = std::max(bend, tolerance(Quantity::curvature_floor, kind).value / step);
    // Rounding of second differences of the samples, in units of curvature.
    const double noise = tolerance(Quantity::conditioning, kind).value * rounding / (slope * step);
    if (!(noise <= tolerance(Quantity::tiny_gradient, kind).value * scale)) continue;
    compared++;
    const double allowed = tolerance(Quantity::curvature, kind).value * scale + noise;

    check(
        "normal", i, glm::length(glm::dvec3(normals[i]) - exact.normal),
        tolerance(Quantity::normal, kind).value + tolerance(Quantity::normal_rounding, kind).value * rounding / slope);
    check("mean", i, std::abs(mean[i] - exact.mean), allowed);
    check("gauss", i, std::abs(gauss[i] - exact.gauss), 2 * allowed * scale);
    check("k1", i, std::abs(principal[i].x - exact.k1), allowed);
    check("k2", i, std::abs(principal[i].y - exact.k2), allowed);
    check("normal curvature", i, std::abs(along[i] - normal_curvature_along(exact, glm::dvec3(directions[i]))),
          2 * allowed);

    // Directions turn by the error of curvature over the difference of the principal ones; sign free.
    const double apart = exact.k1 - exact.k2;
    if (apart > 0.05 * scale && !(status[i] & PointStatus::umbilic)) {
      const double turn =
          tolerance(Quantity::direction, kind).value / tolerance(Quantity::curvature, kind).value * allowed / apart;
      check("d1", i, glm::length(glm::cross(glm::dvec3(first[i]), exact.d1)), turn);
      check("d2", i, glm::length(glm::cross(glm::dvec3(second[i]), exact.d2)), turn);
    }
    check("|d1|", i, std::abs(glm::length(glm::dvec3(first[i])) - 1), 1e-5);
    check("d1·normal", i, std::abs(glm::dot(first[i], normals[i])), 1e-5);
    check("d1·d2", i, std::abs(glm::dot(first[i], second[i])), 1e-5);
    check("k1 >= k2", i, principal[i].x >= principal[i].y ? 0 : 1, 0.5);
    EXPECT_FALSE(status[i] & PointStatus::undefined) << where << ", hit " << i;
  }
  std::string all;
  for (const auto& [what, found] : worst) {
    all += fmt::format(" {} {:.2g}", what, found.first);
    if (found.first <= 1) continue;
    const std::size_t i = found.second;
    const glm::vec3 p = hits.locations()[i];
    ADD_FAILURE() << where << ": " << what << " errs by " << found.first << " times what is allowed at hit " << i
                  << fmt::format(" ({:.9g}, {:.9g}, {:.9g})", p.x, p.y, p.z) << ", of " << compared << " compared";
  }
  if (testing::Test::HasFailure()) std::cerr << "  " << where << ": error / tolerance:" << all << "\n";
}

std::map<std::string, Totals> run(const GridCase& c) {
  EXPECT_FALSE(test_devices().empty()) << "no device at all";
  return run(c, test_devices());
}

std::map<std::string, Totals> run(const GridCase& c, std::span<TestDevice> devices) {
  const auto field = std::make_shared<const GridField>(c.volume, c.reconstruction);
  const std::vector<RayFamily> families = families_of(c);
  std::vector<Truth> truths;
  for (const RayFamily& family : families) truths.emplace_back(field, c.isovalue, family.rays);

  const Surface surface = isosurface(c.volume, c.isovalue, {c.reconstruction});
  std::map<std::string, Totals> totals;
  std::vector<Judged> base;  // of the first device that is not slow
  for (TestDevice& device : devices) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, surface);
    const bool first = base.empty() && !device.slow;
    Totals& total = totals[device.label];
    for (std::size_t i = 0; i < families.size(); i++) {
      const Judged* known = !device.slow && !base.empty() && !first ? &base[i] : nullptr;
      Judged judged = expect_hits(c, field, families[i], truths[i], device, query, known);
      (families[i].random ? total.random : total.hostile).add(judged.verdict);
      if (known && device.name == "opencl") {
        EXPECT_TRUE(same_bytes(known->hits, judged.hits))
            << c.name << ", " << families[i].name << ", on " << device.label << ": the number of lanes shows";
      }
      if (first) base.push_back(std::move(judged));
    }
    if (first || device.slow) {
      std::cerr << "  " << c.name << ", " << device.label << "\n    random:  " << total.random.summary()
                << "\n    hostile: " << total.hostile.summary() << "\n";
    }
    expect_steadiness(c, field, families, device, query);
  }
  return totals;
}

}  // namespace smurf::test
