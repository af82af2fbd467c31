// Isosurfaces of sampled volumes, on every device: hits, statuses and properties against the double-precision truth of
// the same reconstruction, on a million random and a hundred thousand hostile rays over all cases of this file.
#include <gtest/gtest.h>

#include <iostream>
#include <map>

#include "harness/grid_case.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/tolerances.hpp"
#include "truth/analytic.hpp"

KERNELS(find_hits, count_blocks, order_rows, measure, bspline_prefilter, grid_bounds, grid_activate, grid_distances,
        grid_pad);

namespace smurf::test {
namespace {

// 11 cases of 2 x 46,000 random rays, and of 20 hostile families of 460 rays each beside invalid ones.
constexpr std::size_t random_rays = 46000, hostile_rays = 460;

struct Scene {
  std::string name;
  FieldPointer field;
  Sampling sampling;
  double isovalue;
};

// Distance functions on three placements: as the indices, sheared and left-handed, anisotropic and far from the origin.
Scene sphere() {
  const glm::ivec3 size(32);
  return {"sphere", sphere_field({15.3, 15.9, 15.1}, 11.2), {.size = size}, 0};
}

Scene cylinder() {
  const glm::ivec3 size(28, 33, 21);
  const GridPlacement placement = centered(sheared_placement(0.1, 1), size);
  return {"cylinder", cylinder_field(glm::dvec3(0.0), {1, 2, 3}, 0.6), {.size = size, .placement = placement}, 0.0625};
}

Scene torus() {
  const glm::ivec3 size(40, 40, 24);
  const GridPlacement placement = centered(spacing(3.2, 3.2, 1.5), size, {120, -50, 700});
  return {"torus", torus_field({120, -50, 700}, 36, 11), {.size = size, .placement = placement}, 1.5};
}

Scene polynomial(unsigned seed) {
  const glm::ivec3 size(17, 14, 19);
  const GridPlacement placement = sheared_placement(0.7, seed);
  return {"polynomial " + std::to_string(seed),
          random_polynomial_field(3, size, placement, seed),
          {.size = size, .placement = placement},
          0.125};
}

Scene marschner_lobb() {
  const glm::ivec3 size(40);
  return {"Marschner-Lobb",
          marschner_lobb_field(),
          {.size = size, .placement = centered(spacing(2 / 39., 2 / 39., 2 / 39.), size)},
          0.5};
}

class GridIsosurface : public testing::Test {
 protected:
  static void run(const Scene& scene, Reconstruction reconstruction) {
    const auto totals = test::run(GridCase{.name = scene.name + ", " + std::string(name_of(reconstruction)),
                                           .volume = sample(*scene.field, scene.sampling),
                                           .isovalue = scene.isovalue,
                                           .reconstruction = reconstruction,
                                           .random_rays = random_rays,
                                           .hostile_rays = hostile_rays});
    for (const auto& [device, total] : totals) {
      totals_[device].random.add(total.random);
      totals_[device].hostile.add(total.hostile);
    }
  }

  // Over all cases: how few random rays have a hit that is not isolated.
  static void TearDownTestSuite() {
    constexpr Tolerance share = tolerance(Quantity::flagged_rays, "isosurface");
    for (const auto& [device, total] : totals_) {
      std::cerr << "all cases on " << device << "\n    random:  " << total.random.summary()
                << "\n    hostile: " << total.hostile.summary() << "\n";
      // A few rays more where the batches are small.
      EXPECT_LE(double(total.random.flagged_rays), share.value * double(total.random.rays) + 3)
          << device << ": flagged random rays; " << share.reason;
    }
  }

 private:
  static inline std::map<std::string, Totals> totals_;
};

TEST_F(GridIsosurface, SphereTricubic) { run(sphere(), Reconstruction::tricubic); }
TEST_F(GridIsosurface, SphereTrilinear) { run(sphere(), Reconstruction::trilinear); }
TEST_F(GridIsosurface, CylinderTricubic) { run(cylinder(), Reconstruction::tricubic); }
TEST_F(GridIsosurface, CylinderCatmullRom) { run(cylinder(), Reconstruction::catmull_rom); }
TEST_F(GridIsosurface, TorusTricubic) { run(torus(), Reconstruction::tricubic); }
TEST_F(GridIsosurface, TorusTrilinear) { run(torus(), Reconstruction::trilinear); }
TEST_F(GridIsosurface, PolynomialTricubic) { run(polynomial(2), Reconstruction::tricubic); }
TEST_F(GridIsosurface, PolynomialTrilinear) { run(polynomial(3), Reconstruction::trilinear); }
TEST_F(GridIsosurface, PolynomialCatmullRom) { run(polynomial(4), Reconstruction::catmull_rom); }
TEST_F(GridIsosurface, MarschnerLobbTricubic) { run(marschner_lobb(), Reconstruction::tricubic); }
TEST_F(GridIsosurface, MarschnerLobbCatmullRom) { run(marschner_lobb(), Reconstruction::catmull_rom); }

}  // namespace
}  // namespace smurf::test
