// Paths of walks as files, written row by row.
#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "smurf/walk.hpp"

namespace smurf {

// CSV: path,step,status,x,y,z, then the surface coordinates by the kind's names, where the paths have them; a part
// without a name is left out. VTK XML when the name ends in .vtp: a polyline for each path, a vertex for a path of one
// row; step and status at points, the path's number and its last status (end) at cells. Numbers read back to the same
// float. Written whole or not at all; throws Error (io) when that fails.
void write_paths(const Paths& paths, std::span<const std::string_view> coordinate_names,
                 const std::filesystem::path& file);

}  // namespace smurf
