// Lines of curvature drawn over the picture of their surface.
#pragma once

#include "smurf/camera.hpp"
#include "smurf/curvature_lines.hpp"
#include "smurf/image.hpp"
#include "smurf/interrogator.hpp"

namespace smurf {

// As strokes of about a 250th of the picture's width, in a display colour; where the surface hides them they are left
// out: a ray from the eye to each row tells. `image` was made with `camera`, which is no parallel projection.
void draw_curvature_lines(const Interrogator& query, const Camera& camera, const CurvatureLines& lines,
                          const glm::vec3& colour, Image& image);

}  // namespace smurf
