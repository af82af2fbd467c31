// Ray batches to test with, from fixed seeds: random ones, and hostile ones on which intersection code breaks.
// Rays are made in index coordinates (nodes at 0 … size-1) and placed in the world.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "smurf/rays.hpp"
#include "smurf/volume.hpp"

namespace smurf::test {

struct GridFrame {
  glm::ivec3 size{2};
  GridPlacement placement = {};

  glm::dvec3 to_world(const glm::dvec3& index) const { return placement.origin + placement.axes * index; }
  glm::dvec3 to_index(const glm::dvec3& world) const {
    return glm::inverse(placement.axes) * (world - placement.origin);
  }
  glm::dvec3 last() const { return glm::dvec3(size - 1); }
};
GridFrame frame_of(const Volume& volume);

// A named batch; `random` ones count for the bound on how often hits may be flagged.
struct RayFamily {
  std::string name;
  RayBatch rays;
  bool random = false;
  bool valid = true;  // otherwise every ray must be reported invalid and have no hit
};

// Lines through two random points of the domain, starting outside of it.
RayFamily random_chords(const GridFrame& frame, std::size_t count, unsigned seed);
// Pixels of cameras that look at the domain from random sides, as images of 64 x 64.
RayFamily camera_rays(const GridFrame& frame, std::size_t count, unsigned seed);

// A point of a surface and its normal, in the world.
struct SurfaceSample {
  glm::dvec3 point, normal;
};

// Every hostile family, about `count` rays each. `on_surface` are points of the surface that the rays are meant for,
// used for tangent rays and for rays that start on the surface; without any, these families are left out.
std::vector<RayFamily> hostile_families(const GridFrame& frame, std::span<const SurfaceSample> on_surface,
                                        std::size_t count, unsigned seed);

}  // namespace smurf::test
