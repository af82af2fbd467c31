// Where samples of a regular grid lie.
#pragma once

#include <string_view>

#include "smurf/volume.hpp"

namespace smurf {

// Throws Error (input) that begins with `what` when axes are not finite, have no length or lie in one plane, or the
// origin is not finite.
void require_placement(const GridPlacement& placement, std::string_view what);

}  // namespace smurf
