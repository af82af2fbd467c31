// Rays against Bézier, B-spline and NURBS patches, on every device: exact tori, spheres and cylinders as patches agree
// with closed forms; others with the reference; rays that are aimed at edges and corners exactly pass between no two
// patches, and are told once; closed models are crossed an even number of times; poles cost little.
//
// SMURF_TEST_DENSE=50 makes it 100,000 rays a surface and a million lines through closed models.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "harness/case.hpp"
#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/parametric_case.hpp"
#include "harness/tolerances.hpp"
#include "io/patch_file.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/parametric/definition.hpp"
#include "truth/parametric.hpp"
#include "truth/parametric_rays.hpp"
#include "truth/patches.hpp"
#include "truth/polynomial.hpp"

KERNELS(find_hits, list_open, finish_hits, count_blocks, order_rows);

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::string_view kind = "parametric";
constexpr std::size_t random_rays = 2000, hostile_rays = 60;

void expect_few_flagged(const std::map<std::string, Totals>& totals, const std::string& name) {
  for (const auto& [device, total] : totals) {
    const double allowed = tolerance(Quantity::flagged_rays, kind).value * double(total.random.rays);
    EXPECT_LE(double(total.random.flagged_rays), std::max(allowed, 1.0)) << name << ", " << device;
  }
}

std::vector<RayFamily> families(const std::vector<Patch>& patches, std::size_t random, std::size_t hostile) {
  const auto many = std::size_t(density());
  return parametric_families(sources_of(patches), random * many, hostile * many, 21);
}

// Patches that are exactly the scene's surface.
void expect_as_scene(const std::string& name, const ParametricScene& scene, const std::vector<Patch>& patches) {
  Case one = case_of(name, patches);
  one.rays = families(patches, random_rays, hostile_rays);
  one.oracle = [=](const RayFamily& family) {
    auto oracle = std::make_shared<ExactParametricOracle>(scene, family.rays);
    oracle->place_of = [=](const SurfaceCoordinates& at) {
      return scene.place(point_of(patches[at.part], at.u, at.v).position);
    };
    return oracle;
  };
  expect_few_flagged(run(one), name);
}

void expect_as_reference(const std::string& name, const std::vector<Patch>& patches, std::size_t random,
                         std::size_t hostile) {
  Case one = case_of(name, patches);
  one.rays = families(patches, random, hostile);
  one.oracle = [surface = one.surface, rules = rules_of(patches)](const RayFamily& family) {
    return oracle_by_reference(surface, family.rays, rules);
  };
  expect_few_flagged(run(one), name);
}

TEST(PatchHits, NurbsTorus) { expect_as_scene("NURBS torus", torus_scene(2, 1), {nurbs_torus(2, 1)}); }

TEST(PatchHits, TorusWithWeightsOfZero) {
  expect_as_scene("torus of half circles", torus_scene(2, 1), torus_of_half_circles(2, 1));
}

TEST(PatchHits, NurbsSphere) { expect_as_scene("NURBS sphere", sphere_scene(1.5), {nurbs_sphere(1.5)}); }

TEST(PatchHits, NurbsCylinder) {
  expect_as_scene("NURBS cylinder", cylinder_scene(1.25, 3), {nurbs_cylinder(1.25, 3)});
}

TEST(PatchHits, Quilt) { expect_as_reference("quilt", quilt(3), random_rays, hostile_rays); }

TEST(PatchHits, Folded) { expect_as_reference("folded patch", {folded_patch()}, random_rays, hostile_rays); }

// Along z x and y are cubics of u and v: the number of hits is that of their roots, up to nine.
TEST(PatchHits, FoldedNineTimes) {
  const Patch patch = folded_patch();
  // From Bernstein to powers: 0, 1.75, -0.75, 1.
  const auto cubic = [](double value) {
    return Polynomial({-value, 3 * 1.75L, 3 * (-0.75L - 2 * 1.75L), 1 - 3 * -0.75L + 3 * 1.75L});
  };
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-0.1f, 1.1f);
  const std::size_t count = 2000 * std::size_t(density());
  RayBatch rays(count);
  std::vector<std::size_t> expected(count);
  std::vector<bool> certain(count);
  for (std::size_t i = 0; i < count; i++) {
    const float x = uniform(random), y = uniform(random);
    rays.set(i, {{x, y, -5}, {0, 0, 1}});
    const std::size_t in_u = cubic(x).roots(0, 1).size(), in_v = cubic(y).roots(0, 1).size();
    expected[i] = in_u * in_v;
    // Near a fold, and near the border, floats of the patch's points may tell otherwise.
    certain[i] = true;
    for (const double off : {-1e-5, 1e-5})
      certain[i] = certain[i] && cubic(x + off).roots(0, 1).size() == in_u && cubic(y + off).roots(0, 1).size() == in_v;
  }
  EXPECT_GT(std::ranges::count(expected, 9u), 100);
  for (TestDevice& device : test_devices()) {
    const RayBatch some = device.slow ? first_rays(rays, 200) : rays;
    const HitList hits = Interrogator(device.device, nurbs({patch})).cast(some, {.hits = Hits::all});
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < some.size(); i++)
      wrong += certain[i] && !is_flagged(hits, i) && hits.offsets()[i + 1] - hits.offsets()[i] != expected[i];
    EXPECT_EQ(wrong, 0u) << device.label;
    EXPECT_LT(flagged_rays(hits), some.size() / 500 + 2) << device.label;
  }
}

// ---- Edges and corners

// The direction across an edge, into the patch.
dvec3 inward(const PatchPoint& p, int side) {
  const dvec3 along = side < 2 ? p.v : p.u, across = (side < 2 ? p.u : p.v) * (side % 2 == 0 ? 1.0 : -1.0);
  const double length = glm::length(along);
  if (length == 0) return glm::normalize(across);
  const dvec3 e = along / length;
  return glm::normalize(across - glm::dot(across, e) * e);
}

struct Aimed {
  RayBatch rays;
  std::vector<dvec3> at;
  std::vector<std::array<std::size_t, 2>> patches;
  std::vector<bool> passes;  // from one patch's side to the other's; else a silhouette
};

// Rays at points of shared edges, seen from `views` directions; those that graze a patch there are left out.
Aimed aimed_at_edges(const std::vector<Patch>& patches, const std::vector<SharedEdge>& edges, int views, int points) {
  constexpr double grazing = 0.05;
  const double extent = extent_of(patches);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.02, 0.98);
  std::vector<Ray> rays;
  Aimed aimed;
  for (int view = 0; view < views; view++) {
    // A spiral over the sphere.
    const double z = 1 - (2 * view + 1.0) / views, angle = 2.399963 * view, r = std::sqrt(1 - z * z);
    const dvec3 d(r * std::cos(angle), r * std::sin(angle), z);
    for (const SharedEdge& edge : edges) {
      for (int k = 0; k < points; k++) {
        const double along = uniform(random);
        const dvec2 a = edge.a.place(patches, along), b = edge.b.place(patches, along);
        const PatchPoint p = point_of(patches[edge.a.patch], a.x, a.y), q = point_of(patches[edge.b.patch], b.x, b.y);
        const dvec3 tangent = edge.a.side < 2 ? p.v : p.u;
        if (!(glm::length(tangent) > 1e-3 * extent)) continue;
        const dvec3 across = glm::cross(glm::normalize(tangent), d);
        const double first = glm::dot(across, inward(p, edge.a.side)),
                     second = glm::dot(across, inward(q, edge.b.side));
        if (std::abs(first) < grazing || std::abs(second) < grazing || !(std::abs(first) <= 1 && std::abs(second) <= 1))
          continue;
        rays.push_back({glm::vec3(p.position - 3 * extent * d), glm::vec3(d)});
        aimed.at.push_back(p.position);
        aimed.patches.push_back({edge.a.patch, edge.b.patch});
        aimed.passes.push_back(first * second < 0);
      }
    }
  }
  aimed.rays = RayBatch(rays);
  return aimed;
}

void expect_once_at_edges(const std::string& name, const std::vector<Patch>& patches, int views, int points,
                          double gap) {
  const std::vector<SharedEdge> edges = shared_edges(patches, gap * extent_of(patches));
  ASSERT_GT(edges.size(), 0u) << name;
  const Aimed aimed = aimed_at_edges(patches, edges, views, points);
  const double near = 1e-4 * extent_of(patches);
  const Case one = case_of(name, patches);
  ASSERT_GT(aimed.rays.size(), std::size_t(views) * edges.size() * std::size_t(points) / 3) << name;
  for (TestDevice& device : test_devices()) {
    const RayBatch rays = device.slow ? first_rays(aimed.rays, aimed.rays.size() / 20 + 20) : aimed.rays;
    const HitList hits = Interrogator(device.device, one.surface).cast(rays, {.hits = Hits::all});
    std::size_t wrong = 0, flagged = 0, silhouettes = 0, first_wrong = rays.size();
    for (std::size_t i = 0; i < rays.size(); i++) {
      std::size_t here = 0;
      bool any_flagged = false;
      for (std::size_t k = hits.offsets()[i]; k < hits.offsets()[i + 1]; k++) {
        const std::size_t part = hits.coordinates()[k].part;
        if (part != aimed.patches[i][0] && part != aimed.patches[i][1]) continue;
        const double away = glm::distance(dvec3(hits.locations()[k]), aimed.at[i]);
        const bool is_open = hits.status()[k] != HitStatus::isolated;
        if (away > near + (is_open ? hits.uncertainty()[k] * glm::length(rays[i].direction) : 0)) continue;
        here++;
        any_flagged = any_flagged || is_open;
      }
      flagged += any_flagged;
      silhouettes += !aimed.passes[i];
      const bool right = aimed.passes[i] ? here == 1 : here % 2 == 0;
      if (right || any_flagged) continue;
      if (wrong++ == 0) first_wrong = i;
    }
    std::cerr << "  " << name << ", " << device.label << ": " << rays.size() << " rays at " << edges.size()
              << " edges, " << silhouettes << " at silhouettes, " << flagged << " flagged\n";
    // Where patches are bent so much that the ray leaves them again close by.
    EXPECT_LE(flagged, rays.size() / 200 + 1) << name << ", " << device.label;
    if (wrong == 0) continue;
    // A patch that is bent may be crossed twice there: then the reference says so, too.
    RayBatch doubted(1);
    doubted.set(0, rays[first_wrong]);
    const HitList exact = Interrogator(reference_device(), one.surface).cast(doubted, {.hits = Hits::all});
    if (wrong == 1 && exact.size() == hits.offsets()[first_wrong + 1] - hits.offsets()[first_wrong]) continue;
    const auto& [a, b] = aimed.patches[first_wrong];
    ADD_FAILURE() << name << ", " << device.label << ": " << wrong << " of " << rays.size()
                  << " rays are not told once at the edge; the first: ray " << first_wrong << " at the edge of patches "
                  << a << " and " << b << ", " << (aimed.passes[first_wrong] ? "passing" : "at a silhouette")
                  << "\n  replay: " << one.replay(name + " edges", rays[first_wrong], device.name);
  }
}

TEST(PatchEdges, Quilt) { expect_once_at_edges("quilt", quilt(4), 20, 4 * density(), 1e-12); }

// Neighbours that run the other way.
TEST(PatchEdges, QuiltOfBothOrientations) {
  std::vector<Patch> patches = quilt(4);
  for (std::size_t i = 0; i < patches.size(); i += 2) patches[i] = reversed(patches[i]);
  expect_once_at_edges("quilt of both orientations", patches, 8, 2 * density(), 1e-12);
}

TEST(PatchEdges, TorusOfHalfCircles) {
  expect_once_at_edges("torus of half circles", torus_of_half_circles(2, 1), 20, 8 * density(), 1e-12);
}

TEST(PatchEdges, TeapotFromTwentyViews) {
  if (!has_shared_data("patches/teapot.bpt")) GTEST_SKIP();
  expect_once_at_edges("teapot", load_patches(shared_data("patches/teapot.bpt")), 20, 6 * density(), 1e-6);
}

// Rays at the corners of a sheet over the plane, from above: inner ones are where four patches meet.
TEST(PatchEdges, Corners) {
  constexpr int count = 5;
  const std::vector<Patch> patches = quilt(count);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  std::vector<Ray> rays;
  for (int j = 1; j < count; j++) {
    for (int i = 1; i < count; i++) {
      const Patch& p = patches[std::size_t(j * count + i)];
      const dvec3 corner = point_of(p, 0, 0).position;
      for (int k = 0; k < 20 * density(); k++) {
        const dvec3 d = k == 0 ? dvec3(0, 0, -1) : dvec3(uniform(random), uniform(random), -1);
        rays.push_back({glm::vec3(corner - 3.0 * d), glm::vec3(d)});
      }
    }
  }
  const RayBatch batch(rays);
  for (TestDevice& device : test_devices()) {
    const RayBatch some = device.slow ? first_rays(batch, 40) : batch;
    const HitList hits = Interrogator(device.device, nurbs(patches)).cast(some, {.hits = Hits::all});
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < some.size(); i++)
      wrong += hits.offsets()[i + 1] - hits.offsets()[i] != 1 && !is_flagged(hits, i);
    EXPECT_EQ(wrong, 0u) << device.label;
    EXPECT_LE(flagged_rays(hits), some.size() / 100) << device.label;
  }
}

// ---- Closed models

// Sides that no other side meets as a whole: there the model is not known to be closed.
using Segments = std::vector<std::array<dvec3, 2>>;
Segments open_sides(const Surface& surface) {
  const auto& model = dynamic_cast<const ParametricSurface&>(surface.model());
  constexpr int count = 32;
  Segments segments;
  for (std::size_t piece = 0; piece < model.pieces().size(); piece++) {
    const PieceBorders& borders = model.topology().pieces[piece];
    for (std::size_t side = 0; side < 4; side++) {
      if (borders.edges[side] != no_edge || borders.collapsed[side]) continue;
      const auto place = [&](int i) {
        const double along = double(i) / count, end = side % 2 == 0 ? 0 : 1;
        const dvec2 at = side < 2 ? dvec2(end, along) : dvec2(along, end);
        return model.pieces().at(piece, at.x, at.y).position;
      };
      for (int i = 0; i < count; i++) segments.push_back({place(i), place(i + 1)});
    }
  }
  return segments;
}

double distance_to(const Segments& segments, const Ray& line) {
  const dvec3 d = glm::normalize(dvec3(line.direction)), o(line.origin);
  const auto across = [&](const dvec3& p) { return p - d * glm::dot(p, d); };
  double least = HUGE_VAL;
  for (const auto& [from, to] : segments) {
    const dvec3 a = across(from - o), edge = across(to - o) - a;
    const double square = glm::dot(edge, edge), part = square > 0 ? -glm::dot(a, edge) / square : 0;
    least = std::min(least, glm::length(a + edge * std::clamp(part, 0.0, 1.0)));
  }
  return least;
}

void expect_even(const std::string& name, const std::vector<Patch>& patches, std::size_t lines,
                 bool report_only = false, bool is_flat = false) {
  TestDevice* device = test_device("opencl");
  if (!device) {
    report_missing("OpenCL");
    GTEST_SKIP() << "no OpenCL";
  }
  const Case one = case_of(name, patches);
  const Interrogator query(device->device, one.surface);
  const RaySources sources = sources_of(patches);
  const Segments open = open_sides(one.surface);
  const double gap = 1e-4 * glm::length(sources.box.upper - sources.box.lower);
  std::vector<RayFamily> batches;
  for (RayFamily& family : parametric_families(sources, lines, lines / 50, 31))
    if (family.valid) batches.push_back(std::move(family));
  // Through every corner, and points of every side.
  std::mt19937 random(32);
  std::normal_distribution<double> normal;
  std::vector<Ray> rays;
  const double diagonal = glm::length(sources.box.upper - sources.box.lower);
  for (std::size_t patch = 0; patch < patches.size(); patch++) {
    for (int side = 0; side < 4; side++) {
      for (const double along : {0.0, 0.25, 0.5, 1.0 / 3, 1.0}) {
        const dvec2 at = Side{patch, side}.place(patches, along);
        const dvec3 p = point_of(patches[patch], at.x, at.y).position,
                    d = glm::normalize(dvec3(normal(random), normal(random), normal(random)));
        rays.push_back({glm::vec3(p - 2 * diagonal * d), glm::vec3(d)});
      }
    }
  }
  batches.push_back({"every corner and side", RayBatch(rays)});
  for (const RayFamily& family : batches) {
    RayBatch whole = family.rays;
    std::ranges::fill(whole.component(RayBatch::t_min), -whole_line);
    std::ranges::fill(whole.component(RayBatch::t_max), whole_line);
    const HitList hits = query.cast(whole, {.hits = Hits::all});
    const std::size_t flagged = flagged_rays(hits);
    std::size_t odd = 0, first = whole.size();
    for (std::size_t i = 0; i < whole.size(); i++) {
      const bool even = (hits.offsets()[i + 1] - hits.offsets()[i]) % 2 == 0;
      if (even || is_flagged(hits, i) || distance_to(open, whole[i]) < gap) continue;
      // Flat faces are not hit by lines that run in them, and their edges are all that tells: floats may lose one.
      const glm::vec3 d = whole[i].direction;
      if (is_flat && std::abs(d.z) < 1e-6f * glm::length(d)) continue;
      odd++;
      first = std::min(first, i);
    }
    if (report_only || family.random) {
      std::cerr << "  " << name << ", " << family.name << ": " << whole.size() << " lines, " << hits.size() << " hits, "
                << odd << " odd, " << flagged << " flagged\n";
    }
    if (report_only) continue;
    EXPECT_EQ(odd, 0u) << name << ", " << family.name << ": of " << whole.size() << " lines, the first is " << first
                       << "\n  replay: "
                       << one.replay(name + " even", whole[std::min(first, whole.size() - 1)], "opencl");
    if (!family.random) continue;
    EXPECT_LE(double(flagged), std::max(1.0, tolerance(Quantity::flagged_rays, kind).value * double(hits.ray_count())))
        << name << ", " << family.name;
  }
}

std::size_t closed_lines() { return 10000 * std::size_t(density()); }

TEST(PatchHits, LinesCrossToriEvenly) {
  expect_even("NURBS torus", {nurbs_torus(2, 1)}, closed_lines());
  expect_even("torus of half circles", torus_of_half_circles(2, 1), closed_lines());
  expect_even("NURBS sphere", {nurbs_sphere(1)}, closed_lines());
}

TEST(PatchHits, LinesCrossTheEggEvenly) {
  if (!has_shared_data("patches/gismo/egg.json")) GTEST_SKIP();
  expect_even("egg", load_patches(shared_data("patches/gismo/egg.json")), closed_lines());
}

TEST(PatchHits, LinesCrossTheLettersEvenly) {
  if (!has_shared_data("patches/gismo/g_plus_s_surf.json")) GTEST_SKIP();
  expect_even("letters", load_patches(shared_data("patches/gismo/g_plus_s_surf.json")), closed_lines(), false, true);
}

TEST(PatchHits, SharedModels) {
  if (!has_shared_data("patches/teapot.bpt")) GTEST_SKIP();
  for (const std::string file :
       {"teapot.bpt", "octant.bez", "gismo/egg.json", "gismo/scordelis_lo_roof.json", "gismo/cylinder.json"})
    expect_as_reference(file, load_patches(shared_data("patches/" + file)), 500, 20);
}

// ---- Cost

double seconds_of(const Interrogator& query, const RayBatch& rays) {
  query.cast(rays, {.hits = Hits::all});
  double best = HUGE_VAL;
  for (int i = 0; i < 3; i++) {
    const auto start = std::chrono::steady_clock::now();
    query.cast(rays, {.hits = Hits::all});
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

// Rays through and near poles beside rays at the surface elsewhere, as many of each and each from its own direction.
TEST(PatchHits, PolesCostLittle) {
  TestDevice* device = test_device("opencl");
  if (!device) {
    report_missing("OpenCL");
    GTEST_SKIP() << "no OpenCL";
  }
  for (const bool of_patches : {true, false}) {
    const ParametricScene scene = sphere_scene(1);
    const Interrogator query(device->device, of_patches ? nurbs({nurbs_sphere(1)}) : scene.surface());
    std::mt19937 random(6);
    std::normal_distribution<double> normal;
    const auto any = [&] { return glm::normalize(dvec3(normal(random), normal(random), normal(random))); };
    constexpr std::size_t count = 8192;
    RayBatch at_poles(count), elsewhere(count);
    for (std::size_t i = 0; i < count; i++) {
      const dvec3 pole(0, 0, i % 2 == 0 ? 1 : -1), near = pole + std::pow(10.0, -1.0 - double(i % 8)) * any();
      const dvec3 d = any(), e = any();
      at_poles.set(i, {glm::vec3((i % 4 < 2 ? pole : near) - 3.0 * d), glm::vec3(d)});
      elsewhere.set(i, {glm::vec3(any() - 3.0 * e), glm::vec3(e)});
    }
    const double poles = seconds_of(query, at_poles), others = seconds_of(query, elsewhere);
    std::cerr << "  " << (of_patches ? "NURBS" : "expression") << ": a ray at poles costs " << poles / others
              << " times as much as another\n";
    EXPECT_LT(poles, 50 * others);
  }
}

}  // namespace
}  // namespace smurf::test
