// What is measured on stream surfaces, on every device and by the reference: against closed forms at places (u, τ),
// borders among them; against quantities that the flow keeps; and where the field has no second derivatives, which
// leaves the normal and no curvature.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/stream_case.hpp"
#include "harness/tolerances.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"

KERNELS(find_hits, measure);

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::string_view kind = "stream";
constexpr std::array methods{StreamMethod::mesh};
constexpr std::uint32_t measured =
    Property::location | Property::normal | std::uint32_t(Property::gauss) | std::uint32_t(Property::mean);

const double place = tolerance(Quantity::place, kind).value;

std::size_t few_on(const TestDevice& device, std::size_t count, std::size_t few) {
  return device.slow || device.device.is_reference() ? few : count / sanitized_part * std::size_t(density());
}

// Of float parameters: what rounding them moves a place by is left out of the comparison.
void expect_closed_forms(const std::vector<StreamScene>& scenes, const std::vector<StreamDerivatives>& ways) {
  for (const StreamScene& scene : scenes) {
    const double extent = extent_of(scene);
    for (const StreamMethod method : methods) {
      for (const auto derivatives : ways) {
        const Surface surface =
            scene.surface({.method = method, .tolerance = place * extent, .derivatives = derivatives});
        for (const TestDevice& device : one_of_each()) {
          SCOPED_TRACE(scene.name + ", " + std::string(name_of(derivatives)) + ", on " + device.label);
          std::mt19937 random(5);
          std::uniform_real_distribution<double> in_u(scene.range.x, scene.range.y),
              in_time(scene.time.x, scene.time.y);
          std::vector<SurfaceCoordinates> places;
          for (std::size_t i = 0; i < few_on(device, 2000, 100); i++) {
            dvec2 at(in_u(random), in_time(random));
            if (i % 8 == 0) at.x = i % 16 ? scene.range.x : scene.range.y;
            if (i % 8 == 1) at.y = i % 16 == 1 ? scene.time.x : scene.time.y;
            // Clear of where lines end, and of corners, which belong to either side.
            if (scene.leaves && at.y > 0.95 * scene.leaves(at.x)) continue;
            if (!scene.points.empty() && std::abs(at.x - std::round(at.x)) < 1e-3 && at.x > 0.5 && at.x < 1.5) continue;
            places.push_back({0, float(at.x), float(at.y)});
          }
          const PointProperties found = Interrogator(device.device, surface).properties_at(places, measured);
          double off = 0, turned = 0, gauss = 0, mean = 0;
          const auto keep = [](double& greatest, double value) {
            greatest = std::isnan(value) ? HUGE_VAL : std::max(greatest, value);
          };
          for (std::size_t i = 0; i < places.size(); i++) {
            const PatchPoint p = scene.at(std::clamp(double(places[i].u), scene.range.x, scene.range.y),
                                          std::clamp(double(places[i].v), scene.time.x, scene.time.y));
            const Differential exact = differential_of(p).value();
            const double k = std::max(
                {std::abs(exact.k1), std::abs(exact.k2), tolerance(Quantity::curvature_floor, kind).value / extent});
            keep(off, glm::distance(dvec3(found.location[i]), p.position) / extent);
            keep(turned, glm::distance(dvec3(found.normal[i]), exact.normal));
            keep(gauss, std::abs(found.gauss[i] - exact.gauss) / (k * k));
            keep(mean, std::abs(found.mean[i] - exact.mean) / k);
          }
          std::cout << scene.name << ", " << name_of(derivatives) << ", on " << device.label << ": off " << off
                    << ", normal " << turned << ", K " << gauss << ", H " << mean << "\n";
          EXPECT_LE(off, place);
          EXPECT_LE(turned, tolerance(Quantity::normal, kind).value);
          EXPECT_LE(gauss, tolerance(Quantity::curvature, kind).value);
          EXPECT_LE(mean, tolerance(Quantity::curvature, kind).value);
        }
      }
    }
  }
}

TEST(StreamProperties, AreThoseOfClosedForms) {
  expect_closed_forms(stream_scenes(), {StreamDerivatives::interpolated, StreamDerivatives::integrated});
}

// Hill's vortex, and potential flow past a cylinder: the stream function is that of the seed all over the surface, and
// its gradient is normal to it.
TEST(StreamProperties, WhatTheFlowKeepsIsKept) {
  for (const StreamInvariant& scene : stream_invariants()) {
    for (const StreamMethod method : methods) {
      const Surface surface = scene.surface({.method = method, .tolerance = place * scene.extent});
      const Bounds box = surface.bounds();
      for (const TestDevice& device : one_of_each()) {
        SCOPED_TRACE(scene.name + " on " + device.label);
        const HitList hits =
            Interrogator(device.device, surface).cast(chords_of(box, few_on(device, 20'000, 300)), {.hits = Hits::all});
        // t is a float of about three diagonals.
        const double allowed = place * scene.extent + 0x1p-22 * 3 * glm::distance(box.lower, box.upper);
        double off = 0, turned = 0;
        for (std::size_t i = 0; i < hits.size(); i++) {
          if (hits.status()[i] != HitStatus::isolated && hits.status()[i] != HitStatus::sampled) continue;
          const dvec3 at(hits.locations()[i]), gradient = scene.gradient(at), normal(hits.normals()[i]);
          off = std::max(off, std::abs(scene.excess(at)) / glm::length(gradient));
          turned = std::max(turned, glm::length(glm::cross(normal, glm::normalize(gradient))));
        }
        std::cout << scene.name << " on " << device.label << ": " << hits.size() << " hits, off " << off << " of "
                  << allowed << ", normals " << turned << "\n";
        EXPECT_GT(hits.size(), hits.ray_count() / 10);
        EXPECT_LE(off, allowed);
        EXPECT_LE(turned, 1e-3);
      }
    }
  }
}

// Trilinear fields have kinks, and so have the normals of what they make.
TEST(StreamProperties, OfTrilinearFieldsThereIsNoCurvature) {
  const StreamScene scene = helicoid_stream();
  const VectorField field = helicoid_on_grid({17, 17, 8}, VectorReconstruction::trilinear);
  for (const StreamMethod method : methods) {
    const Surface surface = stream_surface(field, scene.seeds(), {.time = scene.time, .method = method});
    for (const TestDevice& device : one_of_each()) {
      SCOPED_TRACE(device.label);
      const std::vector<SurfaceCoordinates> places{{0, 0.5f, 1.0f}, {0, 0.9f, 4.1f}, {0, 1.1f, 2.3f}};
      const PointProperties found = Interrogator(device.device, surface).properties_at(places, measured);
      for (std::size_t i = 0; i < places.size(); i++) {
        const Differential exact = differential_of(scene.at(places[i].u, places[i].v)).value();
        EXPECT_LE(glm::distance(dvec3(found.normal[i]), exact.normal), 1e-3);
        EXPECT_TRUE(std::isnan(found.gauss[i]) && std::isnan(found.mean[i]));
        EXPECT_TRUE(found.status[i] & PointStatus::undefined);
      }
    }
  }
}

}  // namespace
}  // namespace smurf::test
