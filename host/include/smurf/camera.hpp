// Cameras: the pixels of an image as a ray batch.
#pragma once

#include <glm/glm.hpp>

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

}  // namespace smurf
