// The unit normal, (n + 1)/2 as red, green, blue.
#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

glm::vec3 colour_of_normal(const Scene& scene, std::size_t hit) {
  return to_linear(0.5f * (scene.values.normal[hit] + 1.0f));  // not a number where there is none
}

}  // namespace

const Technique normal{.role = Role::colour, .properties = std::uint32_t(Property::normal), .colour = colour_of_normal};

}  // namespace smurf::techniques
