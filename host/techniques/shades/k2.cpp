// Second principal curvature, as a colour.
#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

std::span<const float> numbers_of(const HitList& /*hits*/, const PointProperties& values) { return values.k2; }

}  // namespace

const Technique k2{.role = Role::colour,
                   .properties = std::uint32_t(Property::principal),
                   .title = "curvature k2",
                   .numbers = numbers_of};

}  // namespace smurf::techniques
