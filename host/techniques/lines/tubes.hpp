// Thin tubes in a picture: a z-buffer of samples² to the pixel, developed band by band.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace smurf {

// A short straight piece of a tube, round at its ends. Places are in pixels from the upper left corner of the picture.
struct TubePiece {
  glm::vec2 from{0.0f}, to{0.0f};
  float from_depth = 0, to_depth = 0;            // along the view, positive
  float from_radius = 0, to_radius = 0;          // in pixels
  float units_per_pixel = 0;                     // of space, at this depth
  glm::vec3 tangent{0.0f};                       // of length 1, in view coordinates: to the right, up, along the view
  glm::vec3 to_eye{0.0f};                        // the same
  glm::vec3 from_colour{0.0f}, to_colour{0.0f};  // linear light
  bool lit = true;
};

struct TubePixel {
  glm::vec3 colour{0.0f};  // sum over the part that is covered
  float coverage = 0;      // 0 to 1
  float depth = 0;         // mean of what is covered
};

// Row by row from the top, width × height pixels.
std::vector<TubePixel> draw_tubes(const std::vector<TubePiece>& pieces, int width, int height, int samples);

}  // namespace smurf
