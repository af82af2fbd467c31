// Borders of Bézier pieces whose control points are the same within a tolerance get the same points to the bit.
#pragma once

#include <vector>

#include "patches/bezier.hpp"

namespace smurf {

// The tolerance is relative to the greatest side of the hull of all control points. Borders are compared forwards and
// reversed, by degree, points and weights. All points of a border that lie within a tenth of the tolerance become one.
void weld_borders(std::vector<BezierPiece>& pieces, double tolerance);

}  // namespace smurf
