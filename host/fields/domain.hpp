// Domains of functions of space.
#pragma once

#include "smurf/surface.hpp"

namespace smurf {

// The domain, if it is a box of finite corners and its radius is none or positive; throws Error (input) otherwise.
const Domain& require_domain(const Domain& domain);

}  // namespace smurf
