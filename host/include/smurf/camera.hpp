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

// Looks at the whole of the bounds: eye = centre + 1.6·diagonal·normalize(0.2, -1, 0.4), up z, 45 degrees.
Camera fitted_camera(const Bounds& bounds, int width, int height);

}  // namespace smurf
