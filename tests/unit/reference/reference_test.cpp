// The double-precision reference against closed forms: fields, curvature, surfaces, and the interrogation built from
// them. Roots along rays: grid_roots_test.cpp. Nothing here needs a device.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "reference/curvature.hpp"
#include "reference/grid/field.hpp"
#include "reference/grid/roots.hpp"
#include "reference/queries.hpp"
#include "smurf/error.hpp"
#include "surfaces/grid/definition.hpp"
#include "unit/reference/reference_volumes.hpp"

namespace smurf {
namespace {

using namespace reference_test;

// --- fields -------------------------------------------------------------------------------------

// A trivariate cubic with small whole coefficients, so that its samples at whole numbers are exact as floats.
struct Cubic {
  double coefficient[4][4][4] = {};

  explicit Cubic(unsigned seed) {
    std::mt19937 random(seed);
    for (int p = 0; p < 4; p++) {
      for (int q = 0; p + q < 4; q++) {
        for (int r = 0; p + q + r < 4; r++) coefficient[p][q][r] = int(random() % 7) - 3;
      }
    }
  }
  // The derivative of orders a, b, c along x, y, z.
  double operator()(dvec3 x, int a = 0, int b = 0, int c = 0) const {
    double powers[3][4];
    const int order[3] = {a, b, c};
    for (int axis = 0; axis < 3; axis++) {
      for (int n = 0; n < 4; n++) {
        double factor = 1;
        for (int i = 0; i < order[axis]; i++) factor *= n - i;
        for (int i = order[axis]; i < n; i++) factor *= x[axis];
        powers[axis][n] = factor;
      }
    }
    double sum = 0;
    for (int p = 0; p < 4; p++) {
      for (int q = 0; p + q < 4; q++) {
        for (int r = 0; p + q + r < 4; r++) sum += coefficient[p][q][r] * powers[0][p] * powers[1][q] * powers[2][r];
      }
    }
    return sum;
  }
};

TEST(ReferenceField, TricubicReproducesCubicsOnShearedGrids) {
  // The mirrored continuation bends a cubic at the border; its influence falls by 0.268 per cell, to 1e-14 in 24 cells.
  const int n = 64, margin = 26;
  for (unsigned seed = 1; seed <= 3; seed++) {
    const Cubic cubic(seed);
    const dvec3 centre(n / 2);
    const GridField field(
        make_volume({n, n, n}, sheared, [&](int i, int j, int k) { return cubic(dvec3(i, j, k) - centre); }),
        Reconstruction::tricubic);
    Uniform uniform(seed);
    for (int i = 0; i < 200; i++) {
      const dvec3 index = uniform.vector(margin, n - 1 - margin), x = index - centre;
      const auto jet = field.jet(sheared.axes * index + sheared.origin);
      ASSERT_TRUE(jet);
      const double tolerance = 1e-9 * 1e3;  // values near the centre reach some thousands
      EXPECT_NEAR(jet->value, cubic(x), tolerance);
      // Derivatives in the directions of the grid are those in index coordinates: no inverse is needed to know them.
      for (int a = 0; a < 3; a++) {
        const dvec3 step = sheared.axes[a];
        EXPECT_NEAR(glm::dot(jet->gradient, step), cubic(x, a == 0, a == 1, a == 2), tolerance);
        for (int b = 0; b < 3; b++) {
          EXPECT_NEAR(glm::dot(step, jet->hessian * sheared.axes[b]),
                      cubic(x, (a == 0) + (b == 0), (a == 1) + (b == 1), (a == 2) + (b == 2)), tolerance);
        }
      }
    }
  }
}

TEST(ReferenceField, EveryReconstructionInterpolatesTheSamples) {
  for (const ivec3 size : {ivec3(6, 5, 4), ivec3(2, 3, 7), ivec3(1, 4, 2), ivec3(1, 1, 1)}) {
    const Volume volume = noise_volume(size, sheared, 5);
    for (const Reconstruction reconstruction : all_reconstructions) {
      const GridField field(volume, reconstruction);
      for (std::size_t i = 0; i < volume.count(); i++) {
        const dvec3 index(int(i) % size.x, int(i) / size.x % size.y, int(i) / size.x / size.y);
        const auto value = field.value(field.to_world(index));
        ASSERT_TRUE(value);
        EXPECT_NEAR(*value, volume.at(i), 1e-13);
      }
    }
  }
}

TEST(ReferenceField, DerivativesAgreeWithDifferencesOfTheValue) {
  const Volume volume = noise_volume({9, 8, 7}, sheared, 6);
  for (const Reconstruction reconstruction : {Reconstruction::tricubic, Reconstruction::catmull_rom}) {
    const GridField field(volume, reconstruction);
    Uniform uniform(7);
    for (int i = 0; i < 100; i++) {
      // A step of 1e-4 stays inside the cell, where the field is smooth.
      const dvec3 cell = glm::floor(uniform.vector(0, 1) * dvec3(8, 7, 6));
      const dvec3 p = field.to_world(cell + uniform.vector(0.01, 0.99));
      const auto jet = field.jet(p);
      ASSERT_TRUE(jet);
      const double h = 1e-4;
      for (int a = 0; a < 3; a++) {
        dvec3 step(0);
        step[a] = h;
        const auto above = field.jet(p + step), below = field.jet(p - step);
        ASSERT_TRUE(above && below);
        EXPECT_NEAR(jet->gradient[a], (above->value - below->value) / (2 * h), 2e-6);
        for (int b = 0; b < 3; b++) {
          EXPECT_NEAR(jet->hessian[a][b], (above->gradient[b] - below->gradient[b]) / (2 * h), 2e-5);
        }
      }
    }
  }
}

TEST(ReferenceField, TrilinearDerivativesAreInterpolatedDifferences) {
  // f = x² + 2xy: central differences at inner nodes are exact, one-sided ones at the border are off by half a step.
  const GridField field(make_volume({6, 6, 6}, {}, [](int i, int j, int) { return i * i + 2 * i * j; }),
                        Reconstruction::trilinear);
  const auto inner = field.jet({2.25, 3.5, 1.0});
  ASSERT_TRUE(inner);
  EXPECT_NEAR(inner->gradient.x, 2 * 2.25 + 2 * 3.5, 1e-12);
  EXPECT_NEAR(inner->gradient.y, 2 * 2.25, 1e-12);
  EXPECT_NEAR(inner->hessian[0][0], 2, 1e-12);
  EXPECT_NEAR(inner->hessian[0][1], 2, 1e-12);
  EXPECT_NEAR(inner->hessian[1][1], 0, 1e-12);
  const auto border = field.jet({0, 3, 0});
  ASSERT_TRUE(border);
  EXPECT_NEAR(border->gradient.x, 1 + 2 * 3, 1e-12);
  EXPECT_NEAR(border->gradient.z, 0, 1e-12);
  EXPECT_NEAR(border->hessian[0][0], 0, 1e-12);
  const auto last = field.jet({5, 3, 5});
  ASSERT_TRUE(last);
  EXPECT_NEAR(last->gradient.x, 9 + 2 * 3, 1e-12);
}

TEST(ReferenceField, EndsAtTheOuterNodes) {
  const GridField field(noise_volume({4, 4, 4}, {}, 1), Reconstruction::tricubic);
  EXPECT_TRUE(field.value({3.0000005, 1, 1}));
  EXPECT_FALSE(field.value({3.0001, 1, 1}));
  EXPECT_FALSE(field.value({1, -0.0001, 1}));
  EXPECT_FALSE(field.value({1, double(not_a_number), 1}));
  EXPECT_FALSE(field.jet({infinity, 1, 1}));
}

TEST(ReferenceField, SamplesAreRoundedToFloat) {
  const auto wide = make_volume<double>({2, 2, 2}, {}, [](int, int, int) { return 0.1; });
  EXPECT_EQ(*GridField(wide, Reconstruction::trilinear).value({0, 0, 0}), double(0.1f));
  const auto huge = make_volume<double>({4, 4, 4}, {}, [](int i, int, int) { return i == 0 ? 1e200 : 1.0; });
  const GridField field(huge, Reconstruction::trilinear);  // beyond float: as infinite as on a device
  EXPECT_FALSE(field.value({0.5, 1, 1}));
  EXPECT_TRUE(field.value({2.5, 1, 1}));
}

TEST(ReferenceField, NonFiniteSamplesReachAsFarAsTheirKernel) {
  const auto volume =
      make_volume({9, 9, 9}, {}, [](int i, int j, int k) { return i == 4 && j == 4 && k == 4 ? NAN : i + j; });
  for (const Reconstruction reconstruction : all_reconstructions) {
    const GridField field(volume, reconstruction);
    const bool linear = reconstruction == Reconstruction::trilinear;
    EXPECT_FALSE(field.value({3.5, 4.5, 4.5}));
    EXPECT_EQ(field.value({2.5, 4.5, 4.5}).has_value(), linear);
    EXPECT_FALSE(field.jet({2.5, 4.5, 4.5}));
    EXPECT_TRUE(field.jet({1.5, 4.5, 4.5}));
    EXPECT_TRUE(field.jet({6.5, 6.5, 6.5}));
  }
}

// --- curvature ----------------------------------------------------------------------------------

TEST(ReferenceCurvature, SphereIsUmbilic) {
  Uniform uniform(11);
  for (int i = 0; i < 100; i++) {
    const double r = uniform(0.01, 100);
    const dvec3 n = uniform.direction(), p = r * n;
    const SurfaceFrame frame = level_set_frame(-2.0 * p, dmat3(-2), -1);  // f = -|x|²: denser inside
    EXPECT_LT(glm::distance(frame.normal, n), 1e-14);
    EXPECT_NEAR(frame.k1 * r, 1, 1e-13);
    EXPECT_NEAR(frame.k2 * r, 1, 1e-13);
    EXPECT_EQ(frame.status, PointStatus::umbilic);
    EXPECT_NEAR(normal_curvature(frame, uniform.direction()) * r, 1, 1e-13);
    EXPECT_TRUE(std::isnan(normal_curvature(frame, n)));
  }
}

TEST(ReferenceCurvature, TorusHasItsClosedForm) {
  const double major = 2, minor = 0.7;
  Uniform uniform(12);
  for (int i = 0; i < 200; i++) {
    const double u = uniform(0, 6.3), v = uniform(0, 6.3);
    const double distance = major + minor * std::cos(v);
    const dvec3 p(distance * std::cos(u), distance * std::sin(u), minor * std::sin(v));
    const dvec3 n(std::cos(v) * std::cos(u), std::cos(v) * std::sin(u), std::sin(v));
    const dvec3 around(-std::sin(u), std::cos(u), 0), meridian = glm::cross(n, around);
    // F = (|p|² + R² - r²)² - 4R²(x² + y²), negative inside
    const double w = glm::dot(p, p) + major * major - minor * minor;
    const dmat3 flat(1, 0, 0, 0, 1, 0, 0, 0, 0);
    const dvec3 gradient = 4 * w * p - 8 * major * major * (flat * p);
    const dmat3 hessian = dmat3(4 * w) + 8.0 * glm::outerProduct(p, p) - 8 * major * major * flat;
    const SurfaceFrame frame = level_set_frame(gradient, hessian, 1);
    EXPECT_LT(glm::distance(frame.normal, n), 1e-12);
    EXPECT_NEAR(frame.k1, 1 / minor, 1e-12);
    EXPECT_NEAR(frame.k2, std::cos(v) / distance, 1e-12);
    EXPECT_NEAR(std::abs(glm::dot(frame.d1, meridian)), 1, 1e-12);
    EXPECT_NEAR(std::abs(glm::dot(frame.d2, around)), 1, 1e-12);
    EXPECT_EQ(frame.status, PointStatus::regular);
    EXPECT_NEAR(normal_curvature(frame, around + meridian + n), (frame.k1 + frame.k2) / 2, 1e-12);
  }
}

TEST(ReferenceCurvature, WithoutGradientIsUndefined) {
  EXPECT_EQ(level_set_frame(dvec3(0), dmat3(1), 1).status, PointStatus::undefined);
  EXPECT_EQ(level_set_frame(dvec3(0, infinity, 0), dmat3(1), 1).status, PointStatus::undefined);
  EXPECT_EQ(level_set_frame(dvec3(1, 0, 0), dmat3(infinity), 1).status, PointStatus::undefined);
  EXPECT_TRUE(std::isnan(level_set_frame(dvec3(0), dmat3(1), 1).normal.x));
  const SurfaceFrame plane = level_set_frame(dvec3(0, 0, 3), dmat3(0), -1);
  EXPECT_EQ(plane.status, PointStatus::umbilic);
  EXPECT_EQ(plane.k1, 0);
  EXPECT_NEAR(glm::length(glm::cross(plane.d1, plane.d2)), 1, 1e-15);
}

// --- surfaces in closed form, converging with resolution ------------------------------------------

struct Shape {
  std::function<double(dvec3)> distance;   // positive inside
  std::function<dvec3(dvec3)> curvatures;  // k1, k2 at a point of the surface
};

const dvec3 shape_centre(0.013, -0.021, 0.007);  // on no node

Shape sphere_shape() {
  return {[](dvec3 p) { return 0.5 - glm::length(p - shape_centre); }, [](dvec3) { return dvec3(2, 2, 0); }};
}
Shape cylinder_shape() {
  return {[](dvec3 p) { return 0.5 - std::hypot(p.x - shape_centre.x, p.y - shape_centre.y); },
          [](dvec3) { return dvec3(2, 0, 0); }};
}
Shape torus_shape() {
  const double major = 0.5, minor = 0.25;
  return {[=](dvec3 p) {
            p -= shape_centre;
            return minor - std::hypot(std::hypot(p.x, p.y) - major, p.z);
          },
          [=](dvec3 p) {
            p -= shape_centre;
            const double radius = std::hypot(p.x, p.y);
            return dvec3(1 / minor, (radius - major) / minor / radius, 0);
          }};
}

struct ShapeError {
  double distance = 0, curvature = 0;
  int hits = 0;
};

ShapeError measure_shape(const Shape& shape, Reconstruction reconstruction, int n) {
  const auto field = make_field(sampled(n, dvec3(-1), 2, shape.distance), reconstruction);
  const RayRoots roots(field, 0);
  Uniform uniform(21);
  ShapeError error;
  for (int i = 0; i < 300; i++) {
    const dvec3 target = uniform.vector(-0.5, 0.5), direction = uniform.direction();
    std::vector<ReferenceHit> hits;
    roots.find({target - 4.0 * direction, direction}, false, hits);
    for (const ReferenceHit& hit : hits) {
      const dvec3 p = target + (hit.t - 4.0) * direction;
      if (std::abs(p.z) > 0.8) continue;  // the cylinder near the border
      const auto jet = field->jet(p);
      if (!jet) {
        ADD_FAILURE() << "no jet at a hit";
        continue;
      }
      const SurfaceFrame frame = level_set_frame(jet->gradient, jet->hessian, -1);
      const dvec3 truth = shape.curvatures(p);
      error.distance = std::max(error.distance, std::abs(shape.distance(p)));
      error.curvature = std::max({error.curvature, std::abs(frame.k1 - truth.x), std::abs(frame.k2 - truth.y)});
      error.hits++;
    }
  }
  return error;
}

TEST(ReferenceSurfaces, DistanceFieldsConverge) {
  for (const auto& [name, shape] :
       {std::pair("sphere", sphere_shape()), {"cylinder", cylinder_shape()}, {"torus", torus_shape()}}) {
    const ShapeError coarse = measure_shape(shape, Reconstruction::tricubic, 33);
    const ShapeError fine = measure_shape(shape, Reconstruction::tricubic, 65);
    EXPECT_GT(coarse.hits, 200) << name;
    // Fourth order in location, second in curvature: 16 and 4 in the limit, somewhat less at these resolutions.
    EXPECT_GT(coarse.distance / fine.distance, 8) << name;
    EXPECT_GT(coarse.curvature / fine.curvature, 2.8) << name;
    EXPECT_LT(fine.distance, 1e-5) << name;
    EXPECT_LT(fine.curvature, 2e-2) << name;

    const ShapeError linear_coarse = measure_shape(shape, Reconstruction::trilinear, 33);
    const ShapeError linear_fine = measure_shape(shape, Reconstruction::trilinear, 65);
    EXPECT_GT(linear_coarse.distance / linear_fine.distance, 3.2) << name;  // second order

    const ShapeError catmull_coarse = measure_shape(shape, Reconstruction::catmull_rom, 33);
    const ShapeError catmull_fine = measure_shape(shape, Reconstruction::catmull_rom, 65);
    EXPECT_GT(catmull_coarse.distance / catmull_fine.distance, 5) << name;      // third order
    EXPECT_GT(catmull_coarse.curvature / catmull_fine.curvature, 1.5) << name;  // first order
  }
}

// --- interrogation --------------------------------------------------------------------------------

RayBatch rays_at_sphere(int count) {
  Uniform uniform(51);
  RayBatch rays{std::size_t(count)};
  for (int i = 0; i < count; i++) {
    const dvec3 direction = uniform.direction();
    rays.set(i, {.origin = glm::vec3(uniform.vector(-0.6, 0.6) - 2.0 * direction), .direction = glm::vec3(direction)});
  }
  return rays;
}

std::shared_ptr<const GridIsosurface> sphere_model(double isovalue) {
  static const Volume volume = sampled(33, dvec3(-1), 2, sphere_shape().distance);
  return std::make_shared<GridIsosurface>(volume, isovalue, GridOptions{});
}

TEST(ReferenceQueries, DoesNotDependOnTiles) {
  const auto reference = interrogate_by_reference(*sphere_model(0));
  const RayBatch rays = rays_at_sphere(1000);
  HitList whole, tiled, first;
  std::size_t reported = 0;
  reference->cast(rays, {.hits = Hits::all}, whole);
  reference->cast(rays,
                  {.hits = Hits::all, .tile = 77, .progress = [&](std::size_t done, std::size_t) { reported = done; }},
                  tiled);
  reference->cast(rays, {}, first);
  EXPECT_EQ(reported, 1000u);
  ASSERT_EQ(whole.ray_count(), 1000u);
  ASSERT_GT(whole.size(), 500u);
  ASSERT_TRUE(std::ranges::equal(whole.t(), tiled.t()));
  ASSERT_TRUE(std::ranges::equal(whole.offsets(), tiled.offsets()));
  for (std::size_t ray = 0; ray < rays.size(); ray++) {
    const std::size_t begin = whole.offsets()[ray], end = whole.offsets()[ray + 1];
    ASSERT_EQ(first.offsets()[ray + 1] - first.offsets()[ray], std::min<std::size_t>(1, end - begin));
    if (begin != end) {
      EXPECT_EQ(first.t()[first.offsets()[ray]], whole.t()[begin]);
    }
    for (std::size_t h = begin; h < end; h++) {
      EXPECT_EQ(whole.rays()[h], ray);
      EXPECT_NEAR(glm::distance(dvec3(whole.locations()[h]), shape_centre), 0.5, 1e-4);
    }
  }
}

TEST(ReferenceQueries, MeasuresTheSphere) {
  const auto reference = interrogate_by_reference(*sphere_model(0));
  HitList hits;
  reference->cast(rays_at_sphere(200), {.hits = Hits::all}, hits);
  const std::vector<glm::vec3> directions(hits.size(), glm::vec3(1, 2, 3));
  PointProperties all;
  const std::uint32_t wanted = Property::value | Property::normal | Property::gauss | Property::mean |
                               Property::principal | Property::directions | Property::normal_curvature;
  reference->measure({hits.locations(), {}, directions}, wanted, {}, all);
  EXPECT_EQ(all.measured, wanted);
  for (std::size_t i = 0; i < hits.size(); i++) {
    const dvec3 outward = glm::normalize(dvec3(hits.locations()[i]) - shape_centre);
    EXPECT_NEAR(all.value[i], 0, 1e-6);
    EXPECT_LT(glm::distance(dvec3(all.normal[i]), outward), 1e-3);
    EXPECT_NEAR(all.gauss[i], 4, 0.1);
    EXPECT_NEAR(all.mean[i], 2, 0.03);
    EXPECT_NEAR(all.k1[i], 2, 0.03);
    EXPECT_NEAR(all.k2[i], 2, 0.03);
    EXPECT_GE(all.k1[i], all.k2[i]);
    EXPECT_NEAR(all.normal_curvature[i], 2, 0.03);
    EXPECT_NEAR(glm::dot(all.d1[i], all.d2[i]), 0, 1e-6);
    EXPECT_NEAR(glm::dot(all.d1[i], all.normal[i]), 0, 1e-6);
    EXPECT_EQ(all.status[i] & PointStatus::undefined, 0u);
  }
  const std::vector<glm::vec3> outside{glm::vec3(5), glm::vec3(not_a_number)};
  PointProperties nothing;
  reference->measure({outside}, std::uint32_t(Property::normal), {}, nothing);
  EXPECT_EQ(nothing.status, (Values<std::uint32_t>{PointStatus::undefined, PointStatus::undefined}));
  EXPECT_TRUE(std::isnan(nothing.normal[0].x));
  EXPECT_TRUE(nothing.value.empty());
  EXPECT_THROW(reference->measure({outside}, std::uint32_t(Property::normal_curvature), {}, nothing), Error);
}

TEST(ReferenceQueries, FlagsOrRefusesBadRays) {
  const float inf = std::numeric_limits<float>::infinity();
  RayBatch rays = rays_at_sphere(10);
  const Ray good{.origin = {-2, 0, 0}, .direction = {1, 0, 0}};
  std::vector<Ray> bad(8, good);
  bad[0].direction = glm::vec3(0);
  bad[1].direction.y = not_a_number;
  bad[2].origin.z = inf;
  bad[3].t_min = not_a_number;
  bad[4].t_max = not_a_number;
  bad[5].t_min = inf;
  bad[6].t_min = 3, bad[6].t_max = 2;
  bad[7].t_min = -inf;
  for (std::size_t i = 0; i < bad.size(); i++) rays.set(i, bad[i]);
  rays.set(9, good);
  const auto reference = interrogate_by_reference(*sphere_model(0));
  HitList hits;
  reference->cast(rays, {.hits = Hits::all}, hits);
  for (std::size_t i = 0; i < 10; i++) EXPECT_EQ(hits.ray_status()[i], i < 8 ? RayStatus::invalid : RayStatus::ok) << i;
  EXPECT_EQ(hits.offsets()[8], 0u);
  EXPECT_EQ(hits.offsets()[10] - hits.offsets()[9], 2u);
  try {
    reference->cast(rays, {.bad_rays = BadRays::error}, hits);
    FAIL() << "a bad ray was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_STREQ(error.what(), "ray 0 is invalid: its direction is zero");
  }
}

TEST(ReferenceQueries, TakesAnotherIsovalue) {
  const auto reference = interrogate_by_reference(*sphere_model(0));
  const std::size_t bytes = reference->device_bytes();
  reference->update(sphere_model(0.2));
  EXPECT_EQ(reference->device_bytes(), bytes);
  RayBatch rays{1};
  rays.set(0, {.origin = {-2, float(shape_centre.y), float(shape_centre.z)}, .direction = {1, 0, 0}});
  HitList hits;
  reference->cast(rays, {.hits = Hits::all}, hits);
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_NEAR(hits.t()[1] - hits.t()[0], 0.6, 1e-3);
  reference->update(std::make_shared<GridIsosurface>(noise_volume({5, 5, 5}, {}, 1), 3.0, GridOptions{}));
  reference->cast(rays, {}, hits);
  EXPECT_EQ(hits.size(), 0u);
}

}  // namespace
}  // namespace smurf
