// Curvilinear blocks from PLOT3D files (Walatka et al. 1990, NASA TM 101067): a grid (XYZ) and a solution (Q).
//
// Nothing in these files tells how they are written. Every combination is tried: byte order, Fortran record markers of
// four bytes, number of blocks in front or one block without it, float32 or float64, and in grids iblank or none. One
// must fit the sizes of both files.
#pragma once

#include <filesystem>
#include <vector>

#include "numerics/fact.hpp"
#include "smurf/flow.hpp"

namespace smurf {

struct Plot3d {
  std::vector<CurvilinearBlock> blocks;
  std::vector<Fact> layout;  // what was found, for people
};

// Vectors are momentum / density at the nodes; NaN where the density is 0 or not finite. Nodes with iblank 0 are
// blanked; negative iblank, which overset grids use, counts as valid. Throws Error (input), one line, with the sizes
// expected and found.
Plot3d read_plot3d(const std::filesystem::path& grid, const std::filesystem::path& solution);

}  // namespace smurf
