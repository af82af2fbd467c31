// The distance from the camera, as a colour, light when near.
#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

std::span<const float> numbers_of(const HitList& hits, const PointProperties& /*values*/) { return hits.t(); }

}  // namespace

const Technique depth{.role = Role::colour, .title = "depth", .scale = ColourScale::sequential, .numbers = numbers_of};

}  // namespace smurf::techniques
