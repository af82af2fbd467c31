// Vectors from NRRD files: four axes, the first of which holds three components and has no direction in space.
#pragma once

#include <filesystem>

#include "smurf/flow.hpp"

namespace smurf {

// Whether the header has such axes.
bool nrrd_has_vectors(const std::filesystem::path& file);

// In world axes: a measurement frame is applied. Throws Error (input), one line that names the file.
VectorGrid read_nrrd_vectors(const std::filesystem::path& file);

// Nodes from one file and vectors from another, which has as many along each axis. The places of the two grids
// themselves are of no consequence.
CurvilinearBlock read_nrrd_block(const std::filesystem::path& points, const std::filesystem::path& vectors);

}  // namespace smurf
