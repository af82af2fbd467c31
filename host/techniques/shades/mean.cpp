// Mean curvature, as a colour.
#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

std::span<const float> numbers_of(const HitList& /*hits*/, const PointProperties& values) { return values.mean; }

}  // namespace

const Technique mean{.role = Role::colour,
                     .properties = std::uint32_t(Property::mean),
                     .title = "mean curvature",
                     .numbers = numbers_of};

}  // namespace smurf::techniques
