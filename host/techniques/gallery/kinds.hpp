// One shape as a surface of every kind: what a technique draws of it must not depend on where the surface comes from.
#pragma once

#include <string>
#include <vector>

#include "smurf/surface.hpp"

namespace smurf {

struct SurfaceOfKind {
  std::string name;
  Surface surface;
};

// What a circle of radius `minor` at distance `major` from the z axis sweeps about it: a torus, or with major = 0 a
// sphere, of which a half circle is swept. Normals point outwards. As samples on a grid (of `nodes` along its longest
// side, tricubic), an equation, a black box, expressions in u and v, a NURBS patch, a stream surface of the rotation,
// and a mesh with smooth normals; in this order. But for the grid and the mesh all are exact.
std::vector<SurfaceOfKind> surfaces_of_every_kind(double major, double minor, int nodes = 56);

}  // namespace smurf
