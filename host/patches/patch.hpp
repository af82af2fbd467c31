// What makes a patch valid (smurf/patch.hpp tells what one is).
#pragma once

#include <string>

#include "smurf/patch.hpp"

namespace smurf {

// Throws Error (input) that begins with `what`, when degrees are not 1 to 9, counts do not fit each other, numbers are
// not finite, knots decrease or one of them stands more than degree + 1 times, the range is empty, or a weight is
// negative. Weights may be 0: such control points lie at infinity.
void require_valid(const Patch& patch, const std::string& what);

}  // namespace smurf
