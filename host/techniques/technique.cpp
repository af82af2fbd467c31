#include "techniques/technique.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "smurf/error.hpp"

namespace smurf {

const Technique& technique_of(Shade shade) {
  switch (shade) {
#define SHADE(name, text, help) \
  case Shade::name:             \
    return techniques::name;
#include "smurf/shades.def"
#undef SHADE
  }
  throw Error(ErrorCode::usage, "not a shade");
}

void Ink::dot(double x, double y, double radius, const glm::vec3& colour, float coverage) {
  const int left = std::max(0, int(std::floor(x - radius))), right = std::min(width_ - 1, int(std::ceil(x + radius)));
  const int top = std::max(0, int(std::floor(y - radius))), bottom = std::min(height_ - 1, int(std::ceil(y + radius)));
  for (int j = top; j <= bottom; j++) {
    for (int i = left; i <= right; i++) {
      // Rays go through the middles of their pixels.
      if (std::hypot(i + 0.5 - x, j + 0.5 - y) > radius) continue;
      glm::vec4& ink = inks_[std::size_t(j) * std::size_t(width_) + std::size_t(i)];
      if (coverage > ink.w) ink = glm::vec4(colour, coverage);
    }
  }
}

SeenCurvature seen_curvature(const Scene& scene, std::size_t hit) {
  const PointProperties& values = scene.values;
  SeenCurvature seen{values.k1[hit], values.k2[hit], values.d1[hit], values.d2[hit], false};
  const float along = glm::dot(values.normal[hit], scene.direction(scene.hits.rays()[hit]));
  if (along > 0) {
    std::swap(seen.d1, seen.d2);
    std::swap(seen.k1, seen.k2);
    seen.k1 = -seen.k1;
    seen.k2 = -seen.k2;
  }
  const float difference = seen.k1 - seen.k2;
  seen.usable = std::isfinite(along) && std::isfinite(difference) && std::isfinite(seen.d1.x + seen.d2.x) &&
                (values.status[hit] & (umbilic | undefined)) == 0 &&
                difference > 0.05f * std::max(std::abs(seen.k1), std::abs(seen.k2));
  return seen;
}

float curvedness(const PointProperties& values, std::size_t hit) {
  return std::hypot(values.k1[hit], values.k2[hit]) * float(std::sqrt(0.5));
}

float usual_greatest(std::vector<float> numbers) {
  std::erase_if(numbers, [](float x) { return !std::isfinite(x); });
  if (numbers.empty()) return 0;
  const auto place = numbers.begin() + std::ptrdiff_t(0.95 * double(numbers.size() - 1));
  std::nth_element(numbers.begin(), place, numbers.end());
  return *place;
}

double footprint(const Scene& scene, std::size_t hit) {
  const Camera& camera = scene.camera;
  if (camera.orthographic_height > 0) return camera.orthographic_height / camera.height;
  const double slope = std::tan(glm::radians(camera.field_of_view) / 2);
  return double(scene.hits.t()[hit]) * 2 * slope / camera.height;
}

bool depth_jumps(const Scene& scene, std::size_t hit, std::size_t other) {
  const auto tangent = [&](std::size_t i) {
    const float cosine = std::abs(glm::dot(scene.values.normal[i], scene.direction(scene.hits.rays()[i])));
    return cosine > 0.05f ? std::sqrt(std::max(0.0f, 1 - cosine * cosine)) / cosine : 20.0;  // also for NaN
  };
  const double difference = std::abs(double(scene.hits.t()[hit]) - double(scene.hits.t()[other]));
  const double pixel = std::max(footprint(scene, hit), footprint(scene, other));
  if (difference <= 3 * pixel) return false;
  // At an outline the nearer one is steep and what lies behind is not; on one sheet both are.
  return difference > pixel * (3 + 1.5 * std::min(tangent(hit), tangent(other)));
}

double line_radius(const Scene& scene) { return std::max(0.75, 0.0011 * std::min(scene.width(), scene.height())); }

}  // namespace smurf
