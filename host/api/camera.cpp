// Rays through the pixel centres of an image, computed in double precision and rounded at the end.
#include "smurf/camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

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

namespace {

constexpr std::array<std::string_view, 8> view_names = {"usual", "front", "back",   "left",
                                                        "right", "top",   "bottom", "iso"};

// Where the eye stands, seen from the centre, and what is up in the picture.
struct Stand {
  glm::dvec3 offset, up;
};

Stand stand_of(View view, const glm::dvec3& up_as_given) {
  const double length = glm::length(up_as_given);
  if (!is_finite(up_as_given) || !(length > 0))
    throw Error(ErrorCode::input, fmt::format("camera: up {} must be finite and not zero", shown(up_as_given)));
  const glm::dvec3 up = up_as_given / length;
  const glm::dvec3 side = std::abs(up.y) > std::numbers::sqrt2 / 2 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, -1, 0);
  const glm::dvec3 front = glm::normalize(side - glm::dot(side, up) * up), right = glm::cross(up, front);
  switch (view) {
    case View::front:
      return {front, up};
    case View::back:
      return {-front, up};
    case View::left:
      return {-right, up};
    case View::right:
      return {right, up};
    case View::top:
      return {up, -front};
    case View::bottom:
      return {-up, front};
    case View::iso:
      return {glm::normalize(right + front + up), up};
    case View::usual:
      break;
  }
  return {glm::normalize(0.2 * right + front + 0.4 * up), up};
}

// The least and the greatest of what the eye's place has to satisfy along one axis of the picture. A point (x, z) in
// view coordinates is seen where |x - ex| <= slope·(z - ez).
class Wedge {
 public:
  explicit Wedge(double slope) : slope_(slope) {}
  void add(double x, double z) {
    right_ = std::max(right_, x - slope_ * z);
    left_ = std::max(left_, -x - slope_ * z);
    least_ = std::min(least_, x);
    greatest_ = std::max(greatest_, x);
    symmetric_ = std::min(symmetric_, z - std::abs(x) / slope_);
  }
  double middle() const { return 0.5 * (right_ - left_); }
  double depth() const { return -(right_ + left_) / (2 * slope_); }  // the eye is at most as deep
  double depth_on_axis() const { return symmetric_; }                // the same for an eye at x = 0
  double extent() const { return greatest_ - least_; }
  double centre() const { return 0.5 * (least_ + greatest_); }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  double slope_;
  double right_ = -infinity, left_ = -infinity, least_ = infinity, greatest_ = -infinity, symmetric_ = infinity;
};

constexpr double share_of_picture = 0.95;

}  // namespace

View view_named(std::string_view name) {
  const auto found = std::find(view_names.begin(), view_names.end(), name);
  if (found != view_names.end()) return View(found - view_names.begin());
  std::string known;
  for (const std::string_view one : view_names) known += fmt::format("{}{}", known.empty() ? "" : ", ", one);
  throw Error(ErrorCode::usage, fmt::format("unknown view \"{}\"; known are {}", name, known));
}

Camera fitted_to(const Camera& camera, std::span<const glm::vec3> points, Fit fit) {
  const Projection projection(camera);
  if (points.empty()) return camera;
  const Frame frame = frame_of(camera);
  const bool parallel = projection.is_parallel();
  const double slope = share_of_picture * std::tan(camera.field_of_view * std::numbers::pi / 360.0);
  const double aspect = double(camera.width) / camera.height;
  Wedge across(slope * aspect), along(slope);
  double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (const glm::vec3& point : points) {
    const glm::dvec3 p = projection.in_view(glm::dvec3(point));
    if (!is_finite(p)) continue;
    across.add(p.x, p.z);
    along.add(p.y, p.z);
    nearest = std::min(nearest, p.z);
    farthest = std::max(farthest, p.z);
  }
  const double extent = std::max({across.extent(), along.extent(), farthest - nearest});
  if (!(extent > 0) || !std::isfinite(extent)) return camera;

  Camera fitted = camera;
  const double distance = glm::length(camera.look_at - camera.eye);
  if (parallel) {
    if (fit == Fit::eye) return camera;
    const glm::dvec3 move = across.centre() * frame.right + along.centre() * frame.up;
    fitted.eye += move;
    fitted.look_at += move;
    fitted.orthographic_height = std::max(along.extent(), across.extent() / aspect) / share_of_picture;
  } else if (fit == Fit::eye) {
    const double depth = std::min(across.depth_on_axis(), along.depth_on_axis());
    fitted.eye += std::min(depth, distance * (1 - 1e-3)) * frame.forward;
  } else {
    const double depth = std::min(across.depth(), along.depth());
    fitted.eye += across.middle() * frame.right + along.middle() * frame.up + depth * frame.forward;
    fitted.look_at = fitted.eye + std::max(0.5 * (nearest + farthest) - depth, 1e-3 * distance) * frame.forward;
  }
  return fitted;
}

std::vector<glm::vec3> corners_of(const Bounds& bounds) {
  std::vector<glm::vec3> corners;
  for (int i = 0; i < 8; i++) {
    const glm::dvec3 upper(i & 1, (i >> 1) & 1, i >> 2);
    corners.emplace_back(glm::mix(bounds.lower, bounds.upper, upper));
  }
  return corners;
}

Camera camera_from(View view, const glm::dvec3& up, const Bounds& bounds, int width, int height) {
  const Stand stand = stand_of(view, up);
  Camera camera = fitted_camera(bounds, width, height);
  camera.eye = camera.look_at + glm::length(camera.eye - camera.look_at) * stand.offset;
  camera.up = stand.up;
  if (width < 1 || height < 1) return camera;  // said when it is used
  return fitted_to(camera, corners_of(bounds), Fit::eye);
}

std::optional<glm::dvec3> replacement_of_up(const Camera& camera) {
  const glm::dvec3 view = camera.look_at - camera.eye;
  const double lengths = glm::length(view) * glm::length(camera.up);
  if (!(lengths > 0) || !std::isfinite(lengths)) return std::nullopt;  // wrong otherwise, and said elsewhere
  if (glm::length(glm::cross(view, camera.up)) > 1e-6 * lengths) return std::nullopt;
  return std::abs(view.z) > 0.9 * glm::length(view) ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
}

}  // namespace smurf
