// Pictures of streamlines: thin tubes with light and depth.
//
//   auto lines = tracer.trace(seeds, {.time = 6, .interval = 0.02});
//   auto velocities = tracer.sample(lines.positions).value;
//   auto camera = smurf::fitted_camera(field.bounds(), 512, 512);
//   smurf::save_png(smurf::render(lines, velocities, {.camera = camera}), "flow.png");
//
// Each line is drawn as a tube that is lit by its own normals, which is what illuminated lines (Zöckler, Stalling, Hege
// 1996) come to where a line is wider than a pixel. Depth shows by perspective, by colours that fade to the background,
// and by shade about what lies in front (Luft, Colditz, Deussen, Image Enhancement by Unsharp Masking the Depth Buffer,
// 2006).
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "smurf/camera.hpp"
#include "smurf/flow.hpp"
#include "smurf/image.hpp"
#include "smurf/render.hpp"

namespace smurf {

enum class LineShade {
  speed,  // the length of the velocity
  time,   // from the seed
  none    // one colour
};

std::string_view name_of(LineShade shade);
LineShade line_shade_named(std::string_view name);  // throws Error (usage) on unknown names

struct LineRenderOptions {
  Camera camera;
  LineShade shade = LineShade::speed;
  double radius = 0;          // of the tubes, in units of space; 0: a 500th of the extent of the lines and the box
  std::optional<Bounds> box;  // drawn in thin lines
  int samples = 3;            // per pixel and axis, 1 to 16
  // What the ends of the colour map stand for. By default the 1st and the 99th percentile of speeds, rounded outwards
  // to two digits, or the least and the greatest time.
  std::optional<ValueRange> range;
  bool legend = true;  // of the colour map; left out where the picture is too small for it to be read
};

// `velocities` are those of the field at the rows of the lines; between rows a line is drawn as the cubic that has
// them. Where they are missing (an empty span) or not finite, differences of neighbouring rows are taken.
// Throws Error (usage) on options that cannot be meant, and on velocities that do not fit the lines; Error (input) on a
// bad camera.
Image render(const Streamlines& lines, std::span<const glm::vec3> velocities, const LineRenderOptions& options);

}  // namespace smurf
