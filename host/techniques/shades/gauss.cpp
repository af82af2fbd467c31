// Gauss curvature, as a colour.
#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

std::span<const float> numbers_of(const HitList& /*hits*/, const PointProperties& values) { return values.gauss; }

}  // namespace

const Technique gauss{.role = Role::colour,
                      .properties = std::uint32_t(Property::gauss),
                      .title = "gauss curvature",
                      .numbers = numbers_of};

}  // namespace smurf::techniques
