// Volumes of every sample type, shape and scale: integers, missing samples, plateaus on the isovalue, one sample thick,
// tiny and huge.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "harness/grid_case.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/replay.hpp"
#include "truth/analytic.hpp"

KERNELS(find_hits, grid_bounds, grid_activate, grid_distances, bspline_prefilter, measure);

namespace smurf::test {
namespace {

constexpr Reconstruction all_reconstructions[] = {Reconstruction::trilinear, Reconstruction::tricubic,
                                                  Reconstruction::catmull_rom};

std::vector<TestDevice> devices() {
  std::vector<TestDevice> out = one_of_each();
  out.pop_back();  // the reference is the truth here
  return out;
}

template <class T>
Volume volume_of(const std::vector<T>& values, glm::ivec3 size, const GridPlacement& placement = {}) {
  const auto samples = std::make_shared<std::vector<T>>(values);
  return Volume(std::shared_ptr<const void>(samples, samples->data()), sample_type_of<T>(), size, placement);
}

// A few thousand rays of every family, judged as in isosurface.cpp.
void run_small(const std::string& name, const Volume& volume, double isovalue, Reconstruction reconstruction) {
  std::vector<TestDevice> on = devices();
  run(case_of({.name = name + ", " + std::string(name_of(reconstruction)),
               .volume = volume,
               .isovalue = isovalue,
               .reconstruction = reconstruction,
               .random_rays = 2000,
               .hostile_rays = 40,
               .slow_share = 10,
               .properties = 1000}),
      on);
}

class GridSampleTypes : public testing::TestWithParam<SampleType> {};

TEST_P(GridSampleTypes, AgreeWithTheTruth) {
  const SampleType type = GetParam();
  const bool is_signed =
      type == SampleType::int8 || type == SampleType::int16 || type == SampleType::int32 || type == SampleType::int64;
  const FieldPointer field = torus_field({9.3, 9.1, 6.2}, 5.1, 2.4);
  // Into a range that every type holds, with a remainder that integers round; wide types get large numbers.
  const bool wide = size_of(type) >= 4;
  const Volume volume = sample(*field, {.size = {20, 19, 13},
                                        .type = type,
                                        .scale = wide ? 1234.5 : 14.3,
                                        .offset = is_signed ? -20.0 : (wide ? 20000.0 : 140.0)});
  const double isovalue = std::round(0.35 * volume.minimum() + 0.65 * volume.maximum()) + 0.5;
  for (Reconstruction reconstruction : all_reconstructions)
    run_small(std::string("samples of type ") + name_of(type), volume, isovalue, reconstruction);
}

INSTANTIATE_TEST_SUITE_P(All, GridSampleTypes,
                         testing::Values(SampleType::uint8, SampleType::int8, SampleType::uint16, SampleType::int16,
                                         SampleType::uint32, SampleType::int32, SampleType::uint64, SampleType::int64,
                                         SampleType::float32, SampleType::float64),
                         [](const auto& info) { return std::string(name_of(info.param)); });

TEST(GridSamples, MissingSamplesHaveNoSurfaceWithinTheirReach) {
  const glm::ivec3 size(18);
  const Volume whole = sample(*sphere_field({8.4, 8.6, 8.3}, 5.7), {.size = size});
  std::vector<float> values(static_cast<const float*>(whole.samples()),
                            static_cast<const float*>(whole.samples()) + whole.count());
  std::mt19937 random(3);
  for (int i = 0; i < 12; i++) {
    const std::size_t at = std::uniform_int_distribution<std::size_t>(0, values.size() - 1)(random);
    values[at] = i % 3 == 0 ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
  }
  const Volume volume = volume_of(values, size);
  for (Reconstruction reconstruction : all_reconstructions) run_small("missing samples", volume, 0, reconstruction);
}

TEST(GridSamples, NothingButMissingSamplesIsNoSurface) {
  const Volume volume = volume_of(std::vector<float>(64, std::numeric_limits<float>::quiet_NaN()), glm::ivec3(4));
  for (TestDevice& device : one_of_each()) {
    const Interrogator query(device.device, isosurface(volume, 0));
    EXPECT_EQ(query.cast(random_chords(frame_of(volume), 200, 1).rays, {.hits = Hits::all}).size(), 0u) << device.label;
  }
}

TEST(GridSamples, IntegersWithPlateausOnTheIsovalue) {
  // Values 0 … 3 and isovalue 1: whole cells and faces lie on the surface.
  std::mt19937 random(5);
  const glm::ivec3 size(10, 9, 8);
  std::vector<std::uint8_t> values(std::size_t(size.x * size.y * size.z));
  for (auto& v : values) v = std::uint8_t(std::uniform_int_distribution<int>(0, 3)(random));
  const Volume volume = volume_of(values, size);
  for (TestDevice& device : devices()) {
    for (Reconstruction reconstruction : all_reconstructions) {
      const Case one = case_of(
          {.name = "plateaus", .volume = volume, .isovalue = 1, .reconstruction = reconstruction, .random_rays = 3000});
      const Interrogator query(device.device, one.surface);
      for (const RayFamily& family : one.rays) expect_hits(one, family, *one.oracle(family), device, query);
    }
  }
}

TEST(GridSamples, FlatDataAndIsovaluesOutsideOfTheRangeAreEmpty) {
  const Volume flat = volume_of(std::vector<std::int16_t>(125, 7), glm::ivec3(5));
  const Volume sphere = sample(*sphere_field({4, 4, 4}, 3), {.size = glm::ivec3(9)});
  for (TestDevice& device : one_of_each()) {
    for (Reconstruction reconstruction : all_reconstructions) {
      for (double isovalue : {6.0, 8.0}) {
        const Interrogator query(device.device, isosurface(flat, isovalue, {reconstruction}));
        EXPECT_EQ(query.cast(random_chords(frame_of(flat), 300, 2).rays, {.hits = Hits::all}).size(), 0u)
            << device.label;
      }
      for (double isovalue : {-100.0, 100.0, 1e30}) {
        const Interrogator query(device.device, isosurface(sphere, isovalue, {reconstruction}));
        EXPECT_EQ(query.cast(random_chords(frame_of(sphere), 300, 2).rays, {.hits = Hits::all}).size(), 0u)
            << device.label;
      }
    }
  }
}

TEST(GridSamples, FlatDataOnTheIsovalueIsFlagged) {
  // The field is the isovalue everywhere: every ray that crosses the domain says so, and none claims a root.
  const Volume flat = volume_of(std::vector<float>(125, 7.0f), glm::ivec3(5));
  for (TestDevice& device : one_of_each()) {
    for (Reconstruction reconstruction : all_reconstructions) {
      const Interrogator query(device.device, isosurface(flat, 7, {reconstruction}));
      const HitList hits = query.cast(random_chords(frame_of(flat), 300, 2).rays, {.hits = Hits::all});
      for (HitStatus status : hits.status()) EXPECT_NE(status, HitStatus::isolated) << device.label;
      EXPECT_EQ(hits.size(), 300u) << device.label;
    }
  }
}

TEST(GridSamples, OneSampleThick) {
  // Domains without extent along one, two or three axes: nothing but well-formed hits, and never a crash.
  for (const glm::ivec3 size :
       {glm::ivec3(9, 8, 1), glm::ivec3(1, 9, 7), glm::ivec3(1, 12, 1), glm::ivec3(1, 1, 1), glm::ivec3(2, 2, 2)}) {
    const Volume volume = sample(*layers_field({1.1, 0.9, 0.3}), {.size = size});
    for (Reconstruction reconstruction : all_reconstructions)
      run_small(std::to_string(size.x) + "x" + std::to_string(size.y) + "x" + std::to_string(size.z), volume, 0.25,
                reconstruction);
  }
}

TEST(GridSamples, RaysWithinADomainOfNoThickness) {
  // The plane z = 0 with layers along x: rays in it meet what the reference meets, others cross at one point at most.
  const Volume volume = sample(*layers_field({1.1, 0.4, 0}), {.size = {9, 8, 1}});
  RayBatch rays(8);
  for (std::size_t i = 0; i < 8; i++) rays.set(i, {{-1, float(i) * 0.9f + 0.3f, 0}, {1, 0.05f, 0}});
  for (Reconstruction reconstruction : all_reconstructions) {
    const Surface surface = isosurface(volume, 0.25, {reconstruction});
    const HitList expected = Interrogator(reference_device(), surface).cast(rays, {.hits = Hits::all});
    EXPECT_GT(expected.size(), 8u);
    for (TestDevice& device : devices())
      EXPECT_EQ(Interrogator(device.device, surface).cast(rays, {.hits = Hits::all}).size(), expected.size())
          << device.label << ", " << name_of(reconstruction);
  }
}

TEST(GridSamples, ManySamplesAlongOneAxis) {
  // Numbers of blocks that take every form of a step between rows and slices, and traversals by the bits of floats and
  // by themselves.
  for (const glm::ivec3 size :
       {glm::ivec3(70, 3, 9), glm::ivec3(9, 513, 3), glm::ivec3(3, 6, 514), glm::ivec3(4000, 3, 5)}) {
    const Volume volume = sample(*layers_field(glm::dvec3(40.0) / glm::dvec3(size)), {.size = size});
    for (Reconstruction reconstruction : {Reconstruction::trilinear, Reconstruction::tricubic})
      run_small(std::to_string(size.x) + "x" + std::to_string(size.y) + "x" + std::to_string(size.z), volume, 0.25,
                reconstruction);
  }
}

TEST(GridSamples, TinyAndHugeScales) {
  for (double scale : {1e-6, 1e6}) {
    const glm::ivec3 size(16, 15, 14);
    const GridPlacement placement = centered(sheared_placement(scale, 2), size);
    const Volume volume =
        sample(*sphere_field(glm::dvec3(0.0), 4.5 * scale), {.size = size, .placement = placement, .scale = 1 / scale});
    for (Reconstruction reconstruction : all_reconstructions)
      run_small("scale of " + std::to_string(scale), volume, 0.125, reconstruction);
  }
}

TEST(GridSamples, SmallAndLargeNumbers) {
  for (double scale : {1e-20, 1e20}) {
    const Volume volume = sample(*sphere_field({8.1, 7.9, 8.2}, 5.3), {.size = glm::ivec3(17), .scale = scale});
    for (Reconstruction reconstruction : all_reconstructions)
      run_small("values of " + std::to_string(scale), volume, double(float(0.125 * scale)), reconstruction);
  }
}

TEST(GridSamples, ValuesOfGreatOffset) {
  // A range of 100 about 10,000: rounding is that of the offset.
  const Volume volume =
      sample(*sphere_field({8.1, 7.9, 8.2}, 5.3), {.size = glm::ivec3(17), .scale = 10, .offset = 10000});
  for (Reconstruction reconstruction : all_reconstructions) run_small("great offset", volume, 10001, reconstruction);
}

TEST(GridSamples, BundledHead) {
  const Volume volume = load_volume(std::string(SMURF_SOURCE_DIR) + "/host/data/headsq.nhdr");
  for (Reconstruction reconstruction : all_reconstructions) run_small("headsq", volume, 1150.5, reconstruction);
}

}  // namespace
}  // namespace smurf::test
