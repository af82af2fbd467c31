// Hostile rays for surfaces s(u, v), of expressions and of patches.
#pragma once

#include <cstddef>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "truth/parametric.hpp"
#include "truth/patches.hpp"
#include "truth/rays.hpp"

namespace smurf::test {

// What rays are aimed at. Arguments are in [0, 1].
struct RaySources {
  Bounds box;
  std::function<PatchPoint(double a, double b)> anywhere;
  std::function<PatchPoint(double which, double along)> border;  // where u or v ends; corners where `along` is 0 or 1
  std::vector<glm::dvec3> poles;
};
RaySources sources_of(const ParametricScene& scene);
RaySources sources_of(const std::vector<Patch>& patches);

// Chords of the box and pixels of cameras that look at it, which are `random`; and hostile families, about `hostile`
// rays each: through poles, at and along seams and borders, through corners, parallel to axes, in planes of symmetry,
// tangent, from inside, from the surface, from 1e4 extents away, in windows of t, and invalid ones.
std::vector<RayFamily> parametric_families(const RaySources& sources, std::size_t random, std::size_t hostile,
                                           unsigned seed);
inline std::vector<RayFamily> parametric_families(const ParametricScene& scene, std::size_t random, std::size_t hostile,
                                                  unsigned seed) {
  return parametric_families(sources_of(scene), random, hostile, seed);
}

}  // namespace smurf::test
