// The light of pictures: a headlight and a key light from the upper left, with soft highlights.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "smurf/camera.hpp"

namespace smurf {

// Directions to the lights, fixed to the camera.
struct Lights {
  glm::vec3 key, up;
};

inline Lights lights_of(const Camera& camera) {
  const glm::dvec3 back = glm::normalize(camera.eye - camera.look_at);
  const glm::dvec3 right = glm::normalize(glm::cross(camera.up, back));
  const glm::dvec3 up = glm::cross(back, right);
  return {glm::vec3(glm::normalize(-0.55 * right + 0.75 * up + back)), glm::vec3(up)};
}

struct Light {
  float diffuse;
  float specular;
};

inline Light light_at(const glm::vec3& normal, const glm::vec3& direction, const Lights& lights) {
  const float head = std::max(0.0f, -glm::dot(normal, direction));
  const float key = std::max(0.0f, glm::dot(normal, lights.key));
  const float ambient = 0.09f + 0.05f * glm::dot(normal, lights.up);  // more from above
  const glm::vec3 halfway = glm::normalize(lights.key - direction);
  const float gloss = std::pow(std::max(0.0f, glm::dot(normal, halfway)), 28.0f);
  return {ambient + 0.30f * head + 0.62f * key, 0.16f * gloss * std::min(1.0f, 4 * key)};
}

}  // namespace smurf
