// Rays through the pixel centres of an image, computed in double precision and rounded at the end.
#include "smurf/camera.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "smurf/error.hpp"

namespace smurf {
namespace {

// Columns: to the right of the image, upwards in the image, along the view.
struct Frame {
  glm::dvec3 right, up, forward;
};

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

std::string shown(const glm::dvec3& v) { return fmt::format("({}, {}, {})", v.x, v.y, v.z); }

Frame frame_of(const Camera& camera) {
  const auto fail = [](const std::string& message) { throw Error(ErrorCode::input, message); };
  if (!is_finite(camera.eye) || !is_finite(camera.look_at) || !is_finite(camera.up))
    fail(fmt::format("camera: eye {}, look-at {} and up {} must be finite", shown(camera.eye), shown(camera.look_at),
                     shown(camera.up)));
  const glm::dvec3 view = camera.look_at - camera.eye;
  const double distance = glm::length(view);
  if (!(distance > 0)) fail(fmt::format("camera: eye and look-at are the same point {}", shown(camera.eye)));
  const glm::dvec3 forward = view / distance;
  const double up_length = glm::length(camera.up);
  if (!(up_length > 0)) fail("camera: up is the zero vector");
  const glm::dvec3 right = glm::cross(forward, camera.up / up_length);
  const double sine = glm::length(right);
  if (!(sine > 1e-9))
    fail(fmt::format("camera: up {} is parallel to the view direction {}", shown(camera.up), shown(forward)));
  return {right / sine, glm::cross(right / sine, forward), forward};
}

void check_lens(const Camera& camera) {
  if (camera.width < 1 || camera.height < 1)
    throw Error(ErrorCode::input, fmt::format("camera: an image of {} x {} pixels; both must be at least 1",
                                              camera.width, camera.height));
  if (!std::isfinite(camera.orthographic_height))
    throw Error(ErrorCode::input, "camera: the orthographic height is not finite");
  if (!(camera.orthographic_height > 0) && !(camera.field_of_view > 0 && camera.field_of_view < 180))
    throw Error(ErrorCode::input, fmt::format("camera: a field of view of {} degrees; it must lie between 0 and 180",
                                              camera.field_of_view));
}

}  // namespace

RayBatch Camera::rays() const {
  check_lens(*this);
  const Frame frame = frame_of(*this);
  const bool parallel = orthographic_height > 0;
  // Half the image's height: in world units, or on a plane at distance 1.
  const double half = parallel ? 0.5 * orthographic_height : std::tan(field_of_view * std::numbers::pi / 360.0);
  RayBatch batch(std::size_t(width) * std::size_t(height));
  batch.image_width = std::size_t(width);
  std::size_t index = 0;
  for (int row = 0; row < height; row++) {
    const double y = half * (1.0 - (2.0 * row + 1.0) / height);
    for (int column = 0; column < width; column++) {
      const double x = half * ((2.0 * column + 1.0) - width) / height;  // pixels are square
      const glm::dvec3 offset = x * frame.right + y * frame.up;
      Ray ray;
      ray.origin = glm::vec3(parallel ? eye + offset : eye);
      ray.direction = glm::vec3(parallel ? frame.forward : glm::normalize(frame.forward + offset));
      batch.set(index++, ray);
    }
  }
  return batch;
}

Projection::Projection(const Camera& camera) : eye_(camera.eye), parallel_(camera.orthographic_height > 0) {
  check_lens(camera);
  const Frame frame = frame_of(camera);
  to_view_ = glm::transpose(glm::dmat3(frame.right, frame.up, frame.forward));
  centre_ = 0.5 * glm::dvec2(camera.width, camera.height);
  scale_ = parallel_ ? camera.height / camera.orthographic_height
                     : 0.5 * camera.height / std::tan(camera.field_of_view * std::numbers::pi / 360.0);
}

glm::dvec3 Projection::in_view(const glm::dvec3& point) const { return to_view_ * (point - eye_); }

glm::dvec2 Projection::pixel(const glm::dvec3& in_view) const {
  return centre_ + pixels_per_unit(in_view.z) * glm::dvec2(in_view.x, -in_view.y);
}

Camera fitted_camera(const Bounds& bounds, int width, int height) {
  const double diagonal = glm::length(bounds.upper - bounds.lower);
  Camera camera;
  camera.look_at = 0.5 * (bounds.lower + bounds.upper);
  // A single point is seen from a distance, too.
  camera.eye = camera.look_at + 1.6 * (diagonal > 0 ? diagonal : 1.0) * glm::normalize(glm::dvec3(0.2, -1.0, 0.4));
  camera.up = {0.0, 0.0, 1.0};
  camera.field_of_view = 45.0;
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace smurf
