// Reading PNG files; writing is public (smurf/image.hpp).
#pragma once

#include <filesystem>

#include "smurf/image.hpp"

namespace smurf {

// Any PNG file as 8-bit RGBA. Throws Error (input) when the file is missing, damaged or no PNG file.
Image load_png(const std::filesystem::path& file);

}  // namespace smurf
