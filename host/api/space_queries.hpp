// Questions about points of space, by the questions that a device answers: how far the surface is, and whether a point
// is inside of it.
//
// Distance. Kinds with surface coordinates find their nearest points (kernels/entries/find_nearest.cl). Of level sets
// the surface is sampled once, where the lines of three lattices of `lattice_lines`² lines across the domain cross it;
// a point's search starts at the nearest of these samples and at all that may lie next to a nearer place of the surface
// (as far as every place has a sample within 1.5 spacings), and goes downhill on the surface: by Newton's method with
// its curvature, then by steps of falling length to four sides, which also settle on creases and borders. So the
// distance is that of a place on the surface, hence never less than the true one but by rounding; it is that of the
// nearest place unless that lies on a part that no line of the lattices meets.
//
// Inside. Of level sets the value tells. Rays from the point to three sides count how often they cross a closed mesh.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "numerics/kd_tree.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class SpaceQueries {
 public:
  SpaceQueries(SurfaceQueries& queries, std::shared_ptr<const SurfaceDefinition> model)
      : queries_(queries), model_(std::move(model)) {}

  // What measure() has to tell so that answer() can, beyond `wanted`.
  std::uint32_t needed(std::uint32_t wanted) const;
  // Puts the columns of `wanted` into `values`, which hold those of needed(). Throws Error (usage) where the surface
  // encloses nothing.
  void answer(std::span<const glm::vec3> points, std::uint32_t wanted, PointProperties& values);
  // Throws Error (usage) where the surface encloses nothing.
  void require_answerable(std::uint32_t wanted) const;

 private:
  Values<float> distances(std::span<const glm::vec3> points);
  Values<float> inside_closed(std::span<const glm::vec3> points);
  void sample();

  SurfaceQueries& queries_;
  std::shared_ptr<const SurfaceDefinition> model_;
  std::optional<KdTree> samples_;
  double spacing_ = 0;
};

}  // namespace smurf
