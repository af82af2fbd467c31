#include "smurf/rays.hpp"

#include <algorithm>

namespace smurf {

RayBatch::RayBatch(std::size_t count) : count_(count), values_(component_count * count, 0.0f) {
  const Ray standard;
  std::ranges::fill(component(direction_z), standard.direction.z);
  std::ranges::fill(component(t_max), standard.t_max);
}

RayBatch::RayBatch(std::span<const Ray> rays) : count_(rays.size()), values_(component_count * rays.size()) {
  for (std::size_t i = 0; i < rays.size(); i++) set(i, rays[i]);
}

Ray RayBatch::operator[](std::size_t index) const {
  const auto value = [&](Component which) { return values_[std::size_t(which) * count_ + index]; };
  return {.origin = {value(origin_x), value(origin_y), value(origin_z)},
          .direction = {value(direction_x), value(direction_y), value(direction_z)},
          .t_min = value(t_min),
          .t_max = value(t_max)};
}

void RayBatch::set(std::size_t index, const Ray& ray) {
  const float values[component_count] = {ray.origin.x,    ray.origin.y,    ray.origin.z, ray.direction.x,
                                         ray.direction.y, ray.direction.z, ray.t_min,    ray.t_max};
  for (std::size_t c = 0; c < component_count; c++) values_[c * count_ + index] = values[c];
}

std::span<float> RayBatch::component(Component which) {
  return std::span(values_).subspan(std::size_t(which) * count_, count_);
}

std::span<const float> RayBatch::component(Component which) const {
  return std::span(values_).subspan(std::size_t(which) * count_, count_);
}

}  // namespace smurf
