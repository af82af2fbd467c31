// Where on a surface a point lies, for kinds that have coordinates.
#pragma once

#include <cstdint>

namespace smurf {

// Meshes: `part` is the triangle, and the location is (1-u-v)·a + u·b + v·c of its corners. Surfaces s(u, v): the patch
// and its parameters.
struct SurfaceCoordinates {
  std::uint32_t part = 0;
  float u = 0, v = 0;
};

}  // namespace smurf
