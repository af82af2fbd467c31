// What a technique of rendering is: what it asks of the surface, and what it makes of the answers. Each is one file in
// shades/, which defines techniques::<name>; smurf/shades.def lists them. No technique knows the kind of a surface.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "smurf/camera.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/render.hpp"
#include "techniques/colour_map.hpp"

namespace smurf {

// A picture's rays and what they found. The camera is the finer one, of one pixel a ray.
struct Scene {
  const Camera& camera;
  const RayBatch& rays;
  const HitList& hits;
  const PointProperties& values;
  std::span<const float> numbers;  // of the colour map; empty where no shade maps numbers

  static constexpr std::size_t none = ~std::size_t(0);
  int width() const { return camera.width; }
  int height() const { return camera.height; }
  std::size_t ray_at(int x, int y) const { return std::size_t(y) * std::size_t(camera.width) + std::size_t(x); }
  // The first hit of a ray; none where there is none, and beyond the picture.
  std::size_t hit_at(int x, int y) const {
    if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) return none;
    const std::size_t ray = ray_at(x, y);
    return hits.offsets()[ray] < hits.offsets()[ray + 1] ? std::size_t(hits.offsets()[ray]) : none;
  }
  glm::vec3 direction(std::size_t ray) const {
    return {rays.component(RayBatch::direction_x)[ray], rays.component(RayBatch::direction_y)[ray],
            rays.component(RayBatch::direction_z)[ray]};
  }
};

// What is drawn over a picture: a colour and how much of it covers the surface, per ray.
class Ink {
 public:
  Ink(int width, int height) : width_(width), height_(height), inks_(std::size_t(width) * std::size_t(height)) {}
  // A disc about (x, y), in rays; what covers more wins.
  void dot(double x, double y, double radius, const glm::vec3& colour, float coverage = 1);
  glm::vec4 at(std::size_t ray) const { return inks_[ray]; }  // colour and coverage

 private:
  int width_, height_;
  std::vector<glm::vec4> inks_;
};

// How a technique takes part in a picture.
enum class Role {
  light,   // lights the colour
  colour,  // decides the colour
  shadow,  // darkens what lies under it
  mark,    // draws over it
  layers   // shows all hits of a ray and not the first alone
};

struct Technique {
  Role role;
  std::uint32_t properties = 0;
  // Colours by a map: the title of its legend, the map, and the numbers.
  std::string_view title = {};
  ColourScale scale = ColourScale::diverging;
  std::span<const float> (*numbers)(const HitList& hits, const PointProperties& values) = nullptr;
  // Colours without a map, in linear light.
  glm::vec3 (*colour)(const Scene& scene, std::size_t hit) = nullptr;
  // Shadows: the share of light that is left, by the cosine of the angle between the normal and the view. Alone the
  // technique is another picture, on black.
  float (*shadow)(float cosine) = nullptr;
  float (*alone)(float cosine) = nullptr;
  void (*mark)(const Scene& scene, Ink& ink) = nullptr;
  // Layers: of each hit, 0 to 1.
  std::vector<float> (*opacity)(const Scene& scene) = nullptr;
};

namespace techniques {
#define SHADE(name, text, help) extern const Technique name;
#include "smurf/shades.def"
#undef SHADE
}  // namespace techniques

// The table.
const Technique& technique_of(Shade shade);

// How the surface is curved for who looks at it: with the normal turned to the viewer. `usable` is false where
// directions have no meaning: undefined points, and where k1 and k2 differ by less than a twentieth.
struct SeenCurvature {
  float k1 = 0, k2 = 0;  // k1 >= k2
  glm::vec3 d1{0.0f}, d2{0.0f};
  bool usable = false;
};
SeenCurvature seen_curvature(const Scene& scene, std::size_t hit);

// Square root of the mean square of k1 and k2 (Koenderink's curvedness); NaN where they are not known.
float curvedness(const PointProperties& values, std::size_t hit);
// The value that 95 of 100 finite numbers do not exceed; 0 of none.
float usual_greatest(std::vector<float> numbers);

// Whether two hits, of rays beside each other, lie on different sheets of the surface: their distances differ by more
// than the slopes of both explain.
bool depth_jumps(const Scene& scene, std::size_t hit, std::size_t other);
// Length of a ray's pixel at the hit, in units of space.
double footprint(const Scene& scene, std::size_t hit);

// Width of lines in rays: as thin as may be and still seen.
double line_radius(const Scene& scene);

}  // namespace smurf
