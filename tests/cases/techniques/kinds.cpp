// The same technique draws the same picture of the same shape, whatever kind of surface it comes as.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "harness/devices.hpp"
#include "smurf/render.hpp"
#include "techniques/gallery/kinds.hpp"

namespace smurf::test {
namespace {

constexpr int size = 64;

// How two pictures differ: the mean over all channels, and the share of pixels with a channel that differs by more
// than a twentieth.
struct Difference {
  double mean = 0, share = 0;
};

Difference difference(const Image& a, const Image& b) {
  Difference result;
  const std::size_t pixels = a.rgba.size() / 4;
  for (std::size_t i = 0; i < pixels; i++) {
    int greatest = 0;
    for (std::size_t c = 0; c < 3; c++) {
      const int difference = std::abs(int(a.rgba[4 * i + c]) - int(b.rgba[4 * i + c]));
      greatest = std::max(greatest, difference);
      result.mean += difference / (255.0 * 3 * double(pixels));
    }
    result.share += (greatest > 12 ? 1.0 : 0.0) / double(pixels);
  }
  return result;
}

// Executors; not the reference, which takes minutes for some of the kinds: it gives the truth.
std::vector<TestDevice*> executors(const std::vector<std::string>& names) {
  std::vector<TestDevice*> devices;
  for (const std::string& name : names) {
    if (TestDevice* device = test_device(name)) devices.push_back(device);
  }
  return devices;
}

struct Bound {
  const char* shades;
  std::optional<ValueRange> range;
  double mean, share;
  bool is_like_first = false;  // the shape has none of what the technique draws
};

std::vector<Image> pictures(const Interrogator& query, const Camera& camera, const std::vector<Bound>& bounds) {
  std::vector<Image> images;
  for (const Bound& bound : bounds) {
    RenderOptions options;
    options.camera = camera;
    options.shades = shades_named(bound.shades);
    options.range = bound.range;
    options.legend = false;
    options.samples = 1;
    images.push_back(render(query, options));
  }
  return images;
}

void expect_one_picture(double major, double minor, View view, const std::vector<std::string>& devices,
                        const std::vector<Bound>& bounds) {
  const std::vector<SurfaceOfKind> kinds = surfaces_of_every_kind(major, minor);
  const double reach = major + minor;
  const Camera camera = camera_from(view, {0, 0, 1}, {{-reach, -reach, -minor}, {reach, reach, minor}}, size, size);
  // The equation in double precision is the truth.
  const std::vector<Image> truth = pictures(Interrogator(reference_device(), kinds[1].surface), camera, bounds);
  for (std::size_t i = 1; i < truth.size(); i++) {
    EXPECT_EQ(difference(truth[i], truth[0]).mean == 0, bounds[i].is_like_first) << bounds[i].shades;
  }
  for (const TestDevice* device : executors(devices)) {
    for (const SurfaceOfKind& kind : kinds) {
      const std::vector<Image> images = pictures(Interrogator(device->device, kind.surface), camera, bounds);
      for (std::size_t i = 0; i < bounds.size(); i++) {
        const Difference found = difference(images[i], truth[i]);
        EXPECT_TRUE(found.mean <= bounds[i].mean && found.share <= bounds[i].share)
            << bounds[i].shades << " of the " << kind.name << " on " << device->label << ": mean " << found.mean
            << ", share " << found.share;
      }
    }
  }
}

// Bounds are a few times what was measured: on meshes and grids, whose surfaces are not the exact ones, and of lines,
// where a last bit decides which ray a line covers. Of the exact kinds areas differ by a hundredth of these.
TEST(Techniques, DrawASphereOfEveryKindAlike) {
  expect_one_picture(0, 1, View::usual, {"opencl", "vulkan"},
                     {{"phong", {}, 5e-4, 0.004},
                      {"normal", {}, 5e-4, 0.004},
                      {"contour", {}, 5e-4, 0.004},
                      {"silhouette", {}, 5e-4, 0.004},
                      {"gauss", ValueRange{-2, 2}, 5e-4, 0.004},
                      {"mean,phong", ValueRange{-2, 2}, 5e-4, 0.004},
                      {"k1", ValueRange{-2, 2}, 5e-4, 0.004},
                      {"k2", ValueRange{-2, 2}, 5e-4, 0.004},
                      {"depth", ValueRange{2, 4}, 5e-4, 0.004},
                      {"curvature-opacity", {}, 5e-4, 0.004, true}});
}

TEST(Techniques, DrawATorusOfEveryKindAlike) {
  expect_one_picture(1, 0.4, View::iso, {"opencl"},
                     {{"phong", {}, 3e-4, 0.002},
                      {"crosses", {}, 4e-3, 0.012},
                      {"strokes", {}, 4e-3, 0.006},
                      {"ridges", {}, 3e-4, 0.002, true},
                      {"silhouette", {}, 3e-4, 0.004},
                      {"gauss,contour", ValueRange{-4, 4}, 1.5e-3, 0.004},
                      {"curvature-opacity", {}, 1e-3, 0.004}});
}

// All directions of a sphere are principal ones: whatever a device's rounding makes of them, nothing is drawn.
TEST(Techniques, DrawNoDirectionsOnASphere) {
  for (const TestDevice* device : executors({"opencl"})) {
    for (const SurfaceOfKind& kind : surfaces_of_every_kind(0, 1)) {
      const Interrogator query(device->device, kind.surface);
      const Camera camera = camera_from(View::usual, {0, 0, 1}, {glm::dvec3(-1), glm::dvec3(1)}, size, size);
      const std::vector<Image> images = pictures(
          query, camera, {{"phong", {}, 0, 0}, {"crosses", {}, 0, 0}, {"strokes", {}, 0, 0}, {"ridges", {}, 0, 0}});
      for (std::size_t i = 1; i < images.size(); i++)
        EXPECT_LE(difference(images[i], images[0]).share, 0) << i << " of the " << kind.name << " on " << device->label;
    }
  }
}

}  // namespace
}  // namespace smurf::test
