// How far rays of a direction may step through cells that cannot hold a root.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "smurf/values.hpp"

namespace smurf {

// Six tables of a byte a cell, in blocks of 4³ as kernels/core/grid_distances.inc has them, one for rays whose direction is greatest along x, ahead and
// back, along y, and along z: 0 for active cells; else d so that a ray of this direction meets no active cell before it leaves the cube of cells that are nearer
// than d, 1 at least. `active` has the bits of each block's cells, bit x + 4y + 16z of x | y << 32.
//
// Such a ray moves at most as far sideways as ahead. From a cell it comes, j cells ahead, at most j + 1 cells to the side: what must be empty is that
// pyramid, and not, as for rays of any direction, the whole cube. So rays that have left a part of the surface behind soon take long steps.
Values<std::uint8_t> directed_distances(std::span<const glm::uvec2> active, glm::ivec3 blocks);

}  // namespace smurf
