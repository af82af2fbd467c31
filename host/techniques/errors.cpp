#include "techniques/errors.hpp"

#include <numbers>
#include <random>

namespace smurf {

RayBatch chords_of(const Bounds& box, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };  // the standard's own differ between libraries
  const glm::dvec3 extent = box.upper - box.lower;
  const glm::dvec3 area(extent.y * extent.z, extent.z * extent.x, extent.x * extent.y);
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const double face = uniform() * (area.x + area.y + area.z);
    const int axis = face < area.x ? 0 : face < area.x + area.y ? 1 : 2;
    const bool from_above = uniform() < 0.5;
    glm::dvec3 origin = box.lower;
    for (int a = 0; a < 3; a++) origin[a] += extent[a] * (a == axis ? double(from_above) : uniform());
    const double sine_squared = uniform(), turn = 2 * std::numbers::pi * uniform();
    glm::dvec3 direction;
    direction[axis] = (from_above ? -1 : 1) * std::sqrt(1 - sine_squared);
    direction[(axis + 1) % 3] = std::sqrt(sine_squared) * std::cos(turn);
    direction[(axis + 2) % 3] = std::sqrt(sine_squared) * std::sin(turn);
    rays.set(i, {glm::vec3(origin), glm::vec3(direction)});
  }
  return rays;
}

}  // namespace smurf
