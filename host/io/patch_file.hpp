// Files of patches, by their endings: .bpt (Bézier patches, as the teapot's), .bez (Geomview's BBP and BEZ) and .json
// ({"patches": [{"degree", "size", "knots", "points", "weights", "homogeneous"}]}).
#pragma once

#include <filesystem>
#include <vector>

#include "patches/patch.hpp"

namespace smurf {

// Valid patches, at least one. Throws Error (input) that names the file, the line or patch, and what is wrong.
std::vector<Patch> load_patches(const std::filesystem::path& file);

}  // namespace smurf
