// Light: a headlight and a key light (techniques/light.hpp).
#include "techniques/technique.hpp"

namespace smurf::techniques {

const Technique phong{.role = Role::light, .properties = std::uint32_t(Property::normal)};

}  // namespace smurf::techniques
