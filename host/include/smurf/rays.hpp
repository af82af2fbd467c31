// Ray batches: origins, directions and parameter ranges as a structure of arrays.
//
// A point of ray i is origin + t·direction, the direction as given, normalised or not.
// Hits are reported for t in [t_min, t_max].
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <span>

#include "smurf/values.hpp"

namespace smurf {

struct Ray {
  glm::vec3 origin{0.0f};
  glm::vec3 direction{0.0f, 0.0f, 1.0f};
  float t_min = 0.0f;
  float t_max = std::numeric_limits<float>::infinity();
};

class RayBatch {
 public:
  enum Component { origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, t_min, t_max };
  static constexpr int component_count = 8;

  RayBatch() = default;
  explicit RayBatch(std::size_t count);  // origin 0, direction +z, t in [0, infinity)
  explicit RayBatch(std::span<const Ray> rays);

  std::size_t size() const { return count_; }
  Ray operator[](std::size_t index) const;
  void set(std::size_t index, const Ray& ray);

  // All values of one component, contiguous, to be read or written in bulk.
  std::span<float> component(Component which);
  std::span<const float> component(Component which) const;
  // The whole block: component_count arrays of size() floats, in the order of Component.
  const float* data() const { return values_.data(); }

  // Row length when the rays are the pixels of an image, row by row; 0 otherwise. Devices use it to
  // hand neighbouring pixels to one work item; results do not depend on it.
  std::size_t image_width = 0;

 private:
  std::size_t count_ = 0;
  Values<float> values_;
};

}  // namespace smurf
