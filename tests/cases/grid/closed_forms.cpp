// Isosurfaces of sampled volumes against closed forms: polynomials that a reconstruction reproduces exactly, and
// distance functions, which it approximates to a known order. These hold for the reference as well.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "harness/grid_case.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/tolerances.hpp"
#include "truth/analytic.hpp"

KERNELS(find_hits, order_rows, measure, bspline_prefilter);

namespace smurf::test {
namespace {

JetAt jets_of(const FieldPointer& field) {
  return [field](const glm::dvec3& p) -> std::optional<Jet> { return field->at(p); };
}

// The mirrored continuation bends a B-spline at the border, and the bend fades by sqrt(3) - 2 a node: 13 nodes in it is
// 4e-8. The samples in between are reproduced up to degree 3 by the B-spline, up to degree 2 by Catmull-Rom (whose
// slopes are central differences), up to degree 1 by trilinear, each to rounding.
void expect_polynomial(Reconstruction reconstruction, int degree, int margin, unsigned seed) {
  const glm::ivec3 size(2 * margin + 10);
  const GridPlacement placement = sheared_placement(0.3, seed);
  const FieldPointer field = random_polynomial_field(degree, size, placement, seed);
  const GridCase c{.name = "polynomial of degree " + std::to_string(degree),
                   .volume = sample(*field, {.size = size, .placement = placement}),
                   // The level at the centre, as a float, is met.
                   .isovalue = float(field->at(placement.origin + placement.axes * (0.5 * glm::dvec3(size - 1))).value),
                   .reconstruction = reconstruction,
                   .seed = seed};
  const RayBatch rays =
      chords_between(frame_of(c.volume), glm::dvec3(margin), glm::dvec3(size - 1 - margin), 4000, seed);
  std::vector<std::vector<double>> roots;
  for (std::size_t i = 0; i < rays.size(); i++)
    roots.push_back(field->roots(c.isovalue, glm::dvec3(rays[i].origin), glm::dvec3(rays[i].direction), 0, 1));
  GridTolerances allowed = tolerances_of(c);
  allowed.t = tolerance(Quantity::t, "isosurface, closed form").value;
  const GridOracle oracle(std::make_shared<const GridField>(c.volume, reconstruction), c.isovalue,
                          GridRoots(std::span<const std::vector<double>>(roots)), allowed);
  const Case one = case_of(c, {});

  for (TestDevice& device : one_of_each()) {
    const std::string where = c.name + " by " + std::string(name_of(reconstruction)) + ", on " + device.label;
    const Interrogator query(device.device, one.surface);
    const HitList hits = query.cast(rays, {.hits = Hits::all});
    const Verdict verdict = judge(hits, oracle, rays);
    EXPECT_GT(verdict.roots, 500u) << where;
    // Samples are rounded: a ray that grazes within that rounding could see another number of roots, but none of these
    // does.
    EXPECT_EQ(verdict.failures(), 0u) << where << ": " << verdict.summary() << "; " << verdict.worst;
    std::cerr << "  " << where << ": " << verdict.summary() << "\n";
    expect_properties(one, points_of(c, jets_of(field)), hits, where);

    // Values at points of the interior.
    std::vector<glm::vec3> points(hits.locations().begin(), hits.locations().end());
    for (std::size_t i = 0; i < rays.size(); i++) points.push_back(rays[i].origin);
    const PointProperties measured = query.probe(points, std::uint32_t(Property::value));
    double worst = 0;
    for (std::size_t i = 0; i < points.size(); i++)
      worst = std::max(worst, std::abs(measured.value[i] - field->at(glm::dvec3(points[i])).value));
    EXPECT_LE(worst, allowed.value) << where << ": value";
  }
}

TEST(GridClosedForms, TricubicReproducesCubics) {
  for (unsigned seed : {11u, 12u, 13u}) expect_polynomial(Reconstruction::tricubic, 3, 13, seed);
}
TEST(GridClosedForms, CatmullRomReproducesQuadratics) { expect_polynomial(Reconstruction::catmull_rom, 2, 2, 14); }
TEST(GridClosedForms, TrilinearReproducesLinears) { expect_polynomial(Reconstruction::trilinear, 1, 1, 15); }

// A distance function on a grid of one cell's step.
struct Approximation {
  Reconstruction reconstruction;
  double t;          // voxels
  double normal;     // radians
  double curvature;  // relative to the larger principal curvature
};

void expect_distance_field(const std::string& name, const FieldPointer& field, glm::ivec3 size,
                           const Approximation& allowed) {
  const Volume volume = sample(*field, {.size = size});
  const RayBatch rays = random_chords(frame_of(volume), 3000, 31).rays;
  for (TestDevice& device : one_of_each()) {
    const std::string where = name + " by " + std::string(name_of(allowed.reconstruction)) + ", on " + device.label;
    const Interrogator query(device.device, isosurface(volume, 0, {allowed.reconstruction}));
    const HitList hits = query.cast(rays, {.hits = Hits::all});
    const auto normals = hits.normals();
    const auto principal = hits.principal_curvatures();

    std::size_t compared = 0, other_counts = 0;
    double worst_t = 0, worst_normal = 0, worst_curvature = 0;
    for (std::size_t r = 0; r < rays.size(); r++) {
      const glm::dvec3 o(rays[r].origin), d(rays[r].direction);
      const double reach = 2 * glm::length(glm::dvec3(size)) / glm::length(d);
      std::vector<double> roots = field->roots(0, o, d, 0, reach);
      std::erase_if(roots, [&](double t) {
        const glm::dvec3 p = o + t * d;
        return glm::any(glm::lessThan(p, glm::dvec3(0.0))) || glm::any(glm::greaterThan(p, glm::dvec3(size - 1)));
      });
      const std::size_t first = hits.offsets()[r], count = hits.offsets()[r + 1] - first;
      if (count != roots.size()) {
        other_counts++;  // a chord so short that the approximation decides
        continue;
      }
      for (std::size_t i = 0; i < count; i++) {
        const glm::dvec3 p = o + roots[i] * d;
        const Differential exact = differential_of(field->at(p));
        // The error of the surface's position, seen along the ray.
        const double sine = std::abs(glm::dot(exact.normal, glm::normalize(d)));
        if (sine < 0.1) continue;
        compared++;
        worst_t = std::max(worst_t, std::abs(hits.t()[first + i] - roots[i]) * glm::length(d) * sine);
        worst_normal = std::max(worst_normal, glm::length(glm::dvec3(normals[first + i]) - exact.normal));
        const double bend = std::max(std::abs(exact.k1), std::abs(exact.k2));
        worst_curvature = std::max({worst_curvature, std::abs(principal[first + i].x - exact.k1) / bend,
                                    std::abs(principal[first + i].y - exact.k2) / bend});
      }
    }
    std::cerr << "  " << where << ": " << compared << " hits; distance " << worst_t << " voxel, normal " << worst_normal
              << ", curvature " << worst_curvature << "\n";
    EXPECT_GT(compared, 1000u) << where;
    EXPECT_LE(other_counts, 30u) << where;
    EXPECT_LE(worst_t, allowed.t) << where;
    EXPECT_LE(worst_normal, allowed.normal) << where;
    EXPECT_LE(worst_curvature, allowed.curvature) << where;
  }
}

// Measured in double precision: largest relative error of curvature on a sphere of 8, 16, 32 voxels 3.8e-3, 9.8e-4,
// 2.4e-4 for the B-spline (second order) and 1.5e-1, 7e-2, 3.4e-2 for Catmull-Rom (first order). The position is of
// fourth, third and second order.
TEST(GridClosedForms, SphereOfSixteenVoxels) {
  const FieldPointer field = sphere_field({24.2, 23.9, 24.4}, 16);
  expect_distance_field("sphere", field, glm::ivec3(49), {Reconstruction::tricubic, 1e-3, 1e-3, 1.5e-3});
  expect_distance_field("sphere", field, glm::ivec3(49), {Reconstruction::catmull_rom, 5e-3, 1e-2, 1e-1});
  expect_distance_field("sphere", field, glm::ivec3(49), {Reconstruction::trilinear, 2e-2, 2e-2, 1e-1});
}
// Curved regions end seven samples before the border and before the kinks of the distance: what mirroring bends fades
// by sqrt(3) - 2 a sample.
TEST(GridClosedForms, Cylinder) {
  expect_distance_field("cylinder", cylinder_field({20.3, 19.8, 0}, {0, 0, 1}, 12), {41, 41, 25},
                        {Reconstruction::tricubic, 2e-3, 5e-3, 3e-2});
}
TEST(GridClosedForms, Torus) {
  expect_distance_field("torus", torus_field({28.2, 27.9, 16.3}, 14, 7), {57, 57, 33},
                        {Reconstruction::tricubic, 2e-3, 5e-3, 1e-2});
}

// The judge itself: right hits are found wrong as soon as the truth is another one.
TEST(GridVerdict, NoticesWhatIsWrong) {
  const Volume volume = sample(*sphere_field({8.2, 7.9, 8.4}, 5), {.size = glm::ivec3(17)});
  const GridCase c{.name = "sphere", .volume = volume};
  const auto field = std::make_shared<const GridField>(volume, c.reconstruction);
  const RayBatch rays = random_chords(frame_of(volume), 300, 6).rays;
  const HitList hits = Interrogator(reference_device(), isosurface(volume, 0)).cast(rays, {.hits = Hits::all});
  const GridRoots truth(field, 0, rays);
  std::vector<std::vector<double>> right(rays.size()), fewer, more, moved;
  for (std::size_t i = 0; i < rays.size(); i++)
    for (const Root& root : truth.roots(i)) right[i].push_back(root.t);
  fewer = more = moved = right;
  std::size_t tried = 0;
  for (std::size_t i = 0; i < rays.size(); i++) {
    if (right[i].size() < 2) continue;
    const double a = right[i][0], b = right[i][1], voxels = RayLine(*field, rays[i]).voxels();
    if ((b - a) * voxels < 1) continue;
    tried++;
    fewer[i].erase(fewer[i].begin());
    more[i].insert(more[i].begin() + 1, 0.5 * (a + b));
    moved[i][0] = a + 0.03 / voxels;
  }
  GridTolerances allowed = tolerances_of(c);
  const auto verdict = [&](const std::vector<std::vector<double>>& roots) {
    return judge(hits, GridOracle(field, 0, GridRoots(std::span<const std::vector<double>>(roots)), allowed), rays);
  };
  EXPECT_GT(tried, 50u);
  EXPECT_EQ(verdict(right).failures(), 0u) << verdict(right).worst;
  EXPECT_EQ(verdict(fewer).invented, tried);
  EXPECT_EQ(verdict(fewer).failures(), tried) << verdict(fewer).summary();
  EXPECT_EQ(verdict(more).missed, tried);
  EXPECT_EQ(verdict(more).failures(), tried) << verdict(more).summary();
  // Near the root the field's value decides, and it is right; without it the hit is misplaced.
  EXPECT_EQ(verdict(moved).grazing, tried);
  allowed.value = 0;
  EXPECT_EQ(verdict(moved).misplaced, tried);
  EXPECT_EQ(verdict(moved).failures(), tried) << verdict(moved).summary();
  EXPECT_FALSE(verdict(moved).worst.empty());
  // Far from it the hit is another root's.
  for (std::size_t i = 0; i < rays.size(); i++)
    if (moved[i] != right[i]) moved[i][0] += 0.1 / RayLine(*field, rays[i]).voxels();
  EXPECT_EQ(verdict(moved).missed, tried);
  EXPECT_EQ(verdict(moved).invented, tried);
}

}  // namespace
}  // namespace smurf::test
