// Ray batches to test with, from fixed seeds: random ones, and hostile ones on which intersection code breaks. Surfaces
// of every kind take theirs from here.
//
// Rays of grids are made in index coordinates (nodes at 0 … size-1) and placed in the world; rays of boxes and of
// triangles are made in the world.
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
// Chords of the box of index coordinates [low, high]: rays that begin and end there.
RayBatch chords_between(const GridFrame& frame, const glm::dvec3& low, const glm::dvec3& high, std::size_t count,
                        unsigned seed);
// Pixels of cameras that look at the domain from random sides, as images of 64 x 64.
RayFamily camera_rays(const GridFrame& frame, std::size_t count, unsigned seed);

// A point of a surface and its normal, in the world.
struct SurfaceSample {
  glm::dvec3 point, normal;
};

// Every hostile family of a grid, about `count` rays each. `on_surface` are points of the surface that the rays are
// meant for, used for tangent rays and for rays that start on the surface; without any, these families are left out.
std::vector<RayFamily> hostile_families(const GridFrame& frame, std::span<const SurfaceSample> on_surface,
                                        std::size_t count, unsigned seed);

// Lines through two random points of a box.
struct BoxChords {
  glm::dvec3 lower, upper;
  double before = 0;                      // rays begin so far before the first of their points
  double least_speed = 0.25, speeds = 1;  // directions are of length least_speed … least_speed + speeds
  double radius = 0;                      // where it is not 0, of the ball about 0 that points are in as well
  double inner = 1;                       // every second ray: points are drawn towards 0 by this factor
};
// Chords that begin one and a half diagonals before their first point, outside of the box.
BoxChords chords_of(const glm::dvec3& lower, const glm::dvec3& upper);
RayBatch random_chords(const BoxChords& chords, std::size_t count, unsigned seed);
// Rays from four times b - a before a point a along b - a, for random points a and b of a box about 0.
RayBatch chords_from_afar(const glm::dvec3& upper, std::size_t count, unsigned seed);

// Lines through two random points of the sphere around a box, as far as `whole_line` each way.
RayBatch sphere_chords(const glm::vec3& lower, const glm::vec3& upper, std::size_t count, unsigned seed);
// As far as a line goes that is whole for a surface of any usual size.
inline constexpr float whole_line = 1e30f;
// A line as far as that; nothing where it has no direction.
void add_line(std::vector<Ray>& rays, const glm::vec3& origin, const glm::vec3& direction);
// Lines that meet vertices, edges and planes of triangles exactly or nearly, about `most` of each of ten families.
RayBatch hostile_lines(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces, float size,
                       std::size_t most);
// Parallel lines on a raster that vertices of lattices lie on, in an image's order: packets that meet edges and
// vertices together.
RayBatch raster_lines(const glm::vec3& lower, const glm::vec3& upper, int axis);

// The ray with something that no ray may have: one of 22 faults, counted on.
Ray spoiled(Ray ray, std::size_t which);

}  // namespace smurf::test
