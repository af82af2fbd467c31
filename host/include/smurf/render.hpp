// Rendering: pictures of a surface from the answers to queries, whatever its kind.
//
//   auto image = smurf::render(query, {.camera = smurf::fitted_camera(surface.bounds(), 512, 512)});
//   smurf::save_png(image, "head.png");
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/camera.hpp"
#include "smurf/image.hpp"
#include "smurf/interrogator.hpp"

namespace smurf {

// Shades are techniques of five sorts, which combine: at most one colour, lit by `phong` where that is listed too;
// `contour` darkens what lies under it; lines are drawn over that; `curvature-opacity` shows all layers of the surface
// so. Normals are turned to the viewer for all but colours. Lines and layers without light or colour are
// drawn on the lit surface.
//   phong    light: a headlight and a key light from the upper left, with soft highlights; alone on a plain colour
//   contour  the rule -d·n < 0.6 ? 1 - (-d·n) : 0 of Loeffelmann and Groeller (1999); alone white on black,
//            over others dark, growing from the same threshold
//   silhouette   lines: outlines, where the surface ends or lies before a farther sheet of itself
//   ridges       lines: crests of curvature, where k1 is greatest along d1 (dark) and k2 least along d2 (light)
//   crosses      lines: crosses along the principal directions, warm along d1, cool along d2 (Fig. 5a there), spread
//                evenly over the picture; none where the directions are arbitrary (umbilics)
//   strokes      lines: short strokes along the direction of the stronger curvature, darker where it is stronger
//   curvature-opacity   all hits of a ray, front to back, opaque where curvature is strong and glass where it is weak
//   normal   colour: the unit normal, (n + 1)/2 as red, green, blue
//   gauss, mean, k1, k2   colour: a curvature, cool below 0 and warm above
//   depth    colour: the distance from the camera, light when near
enum class Shade {
#define SHADE(name, text, help) name,
#include "smurf/shades.def"
#undef SHADE
};

std::string_view name_of(Shade shade);
// From a comma-separated list. Throws Error (usage) on unknown names, and on lists with two colours.
std::vector<Shade> shades_named(std::string_view list);
// All names, each with a few words on it, in one line.
std::string shades_help();

struct ValueRange {
  double lower = 0;
  double upper = 0;
};

struct RenderOptions {
  Camera camera;
  std::vector<Shade> shades{Shade::phong};
  int samples = 2;  // rays per pixel and axis
  // What the ends of the colour map stand for. By default for curvatures ±the 95th percentile of what is
  // seen, rounded up to two digits; for depth the nearest and the farthest hit. A range that spans 0 keeps 0 in the
  // middle.
  std::optional<ValueRange> range;
  bool legend = true;  // of the colour map; left out where the picture is too small for it to be read
  std::function<void(std::size_t done, std::size_t total)> progress = {};  // in rays
  // Asked where no ray hits the surface: why. The picture says it after "nothing to see: ", in letters and digits.
  std::function<std::string()> nothing = {};
};

// Hits of all statuses are drawn: the first of each ray, with layers all. Where there is none the picture says so.
// Throws Error (usage) on options that cannot be meant, Error (input)
// on a bad camera.
Image render(const Interrogator& query, const RenderOptions& options);

// The camera moved so that what it sees of the surface fills the picture (fitted_to); as it is where it sees nothing.
// The surface is looked at by two batches of 96 by 96 rays at most.
Camera fitted_camera(const Interrogator& query, const Camera& camera, Fit fit = Fit::eye_and_target);

}  // namespace smurf
