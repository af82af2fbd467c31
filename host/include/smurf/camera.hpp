// Cameras: the pixels of an image as a ray batch.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "smurf/rays.hpp"
#include "smurf/surface.hpp"

namespace smurf {

// A pinhole camera; with `orthographic_height` > 0 a parallel projection of that height in world units.
// Pixel (0, 0) is the upper left; rays go through pixel centres; directions have length 1.
struct Camera {
  glm::dvec3 eye{0.0, -3.0, 0.0};
  glm::dvec3 look_at{0.0};
  glm::dvec3 up{0.0, 0.0, 1.0};
  double field_of_view = 45.0;  // vertical, in degrees
  double orthographic_height = 0.0;
  int width = 512;
  int height = 512;

  // Throws Error (input) when the size is not positive, eye equals look_at, or up is parallel to the view.
  RayBatch rays() const;
};

// Where points are seen in the image of a camera: the inverse of Camera::rays().
class Projection {
 public:
  explicit Projection(const Camera& camera);  // throws as Camera::rays() does

  // To the right, up, and along the view, from the eye, in units of space.
  glm::dvec3 in_view(const glm::dvec3& point) const;
  // x and y of a point in view coordinates, in pixels from the upper left corner of the image; y grows downwards.
  // The point lies in front of the eye, or the projection is a parallel one.
  glm::dvec2 pixel(const glm::dvec3& in_view) const;
  // How many pixels a unit of space has at this depth along the view.
  double pixels_per_unit(double depth) const { return parallel_ ? scale_ : scale_ / depth; }
  bool is_parallel() const { return parallel_; }

 private:
  glm::dvec3 eye_;
  glm::dmat3 to_view_;
  glm::dvec2 centre_;  // of the image, in pixels
  double scale_;       // pixels per unit of space, at depth 1 where the projection is central
  bool parallel_;
};

// Looks at the whole of the bounds: eye = centre + 1.6·diagonal·normalize(0.2, -1, 0.4), up z, 45 degrees.
Camera fitted_camera(const Bounds& bounds, int width, int height);

std::vector<glm::vec3> corners_of(const Bounds& bounds);  // eight

// Sides to look from. Front is the side of -y, or of z where up lies within 45 degrees of the y axis; right is the side
// to the right of who looks from the front. `usual` is from the front, a little from the right and from above: of
// up = z along (0.2, -1, 0.4). `iso` is along (1, -1, 1). From the top and from the bottom, up in the picture points
// away from the front, or to it.
enum class View { usual, front, back, left, right, top, bottom, iso };
View view_named(std::string_view name);  // throws Error (usage), which names those that there are

// Looks at the centre of the bounds from that side; the corners of the bounds fill the picture.
// Throws Error (input) when up is zero or not finite.
Camera camera_from(View view, const glm::dvec3& up, const Bounds& bounds, int width, int height);

enum class Fit {
  eye_and_target,  // moves both, in the same direction of view: the nearest place from which all points are seen
  eye              // moves the eye towards look_at or away from it
};
// The camera with its eye moved so that the points fill the picture, but for a margin of a twentieth. Of points that
// are all one the camera stays as it is, and with none. Parallel projections keep their height where only the eye moves.
// Throws as Camera::rays() does.
Camera fitted_to(const Camera& camera, std::span<const glm::vec3> points, Fit fit = Fit::eye_and_target);

// What `up` has to be replaced by, because it is parallel to the view (within 1e-6): the axis z, or y where the view is
// along z. None where it may stay.
std::optional<glm::dvec3> replacement_of_up(const Camera& camera);

}  // namespace smurf
