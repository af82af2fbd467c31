// Depth in a picture of tubes: what is far fades to the background, and what is near throws shade about it.
#pragma once

#include <vector>

#include "smurf/image.hpp"
#include "techniques/lines/tubes.hpp"

namespace smurf {

Image with_depth(const std::vector<TubePixel>& pixels, int width, int height);

}  // namespace smurf
