// Ridges and valleys (crest lines): where k1 is greatest along d1, of ridges that bend away from the viewer, and k2 is
// least along d2, of valleys. The extrema are found among rays beside each other along the projected direction, as
// edges are by Canny's non-maximum suppression (1986); those weaker than a quarter of the usual greatest curvature
// are left out.
#include <algorithm>
#include <cmath>

#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

constexpr float weakest = 0.25f;

// One curvature of the two, signed so that an extremum is a maximum.
struct Crest {
  float strength, other;
  glm::vec3 direction;
};

Crest crest_of(const SeenCurvature& seen, bool ridge) {
  return ridge ? Crest{seen.k1, seen.k2, seen.d1} : Crest{-seen.k2, -seen.k1, seen.d2};
}

// The strength at a ray beside the hit; -1 where the sheet ends.
float strength_beside(const Scene& scene, std::size_t hit, const glm::dvec2& place, bool ridge) {
  const std::size_t other = scene.hit_at(int(std::floor(place.x)), int(std::floor(place.y)));
  if (other == Scene::none || depth_jumps(scene, hit, other)) return -1;
  const float strength = crest_of(seen_curvature(scene, other), ridge).strength;
  return std::isfinite(strength) ? strength : -1;
}

bool is_crest(const Scene& scene, const Projection& projection, int x, int y, std::size_t hit, bool ridge, float full) {
  const SeenCurvature seen = seen_curvature(scene, hit);
  const Crest crest = crest_of(seen, ridge);
  if (!seen.usable || !(crest.strength > weakest * full) || crest.strength < std::abs(crest.other)) return false;
  const glm::dvec3 point(scene.hits.locations()[hit]);
  const glm::dvec3 end = point + 0.5 * footprint(scene, hit) * glm::dvec3(crest.direction);
  glm::dvec2 step = projection.pixel(projection.in_view(end)) - projection.pixel(projection.in_view(point));
  const double longest = std::max(std::abs(step.x), std::abs(step.y));
  if (!(longest > 0.02)) return false;
  step /= longest;
  // At the next ray a maximum may be as great but for rounding. Farther off it must have fallen, or the surface is
  // curved evenly there, as a torus around its tube, and what is found is noise.
  const double away = std::max(2.0, 0.012 * std::min(scene.width(), scene.height()));
  const glm::dvec2 place(x + 0.5, y + 0.5);
  for (const double sign : {-1.0, 1.0}) {
    const float near = strength_beside(scene, hit, place + sign * step, ridge);
    const float far = strength_beside(scene, hit, place + sign * away * step, ridge);
    if (near < 0 || far < 0 || near > crest.strength || far > 0.98f * crest.strength) return false;
  }
  return true;
}

void draw(const Scene& scene, Ink& ink) {
  static const glm::vec3 dark = to_linear({0.35f, 0.05f, 0.04f}), light = to_linear({0.96f, 0.98f, 1.0f});
  const Projection projection(scene.camera);
  std::vector<float> strengths(scene.hits.size());
  for (std::size_t i = 0; i < strengths.size(); i++)
    strengths[i] = std::max(std::abs(scene.values.k1[i]), std::abs(scene.values.k2[i]));
  const float full = usual_greatest(strengths);
  for (int y = 0; y < scene.height(); y++) {
    for (int x = 0; x < scene.width(); x++) {
      const std::size_t hit = scene.hit_at(x, y);
      if (hit == Scene::none) continue;
      for (const bool ridge : {true, false}) {
        if (is_crest(scene, projection, x, y, hit, ridge, full))
          ink.dot(x + 0.5, y + 0.5, 1.2 * line_radius(scene), ridge ? dark : light);
      }
    }
  }
}

}  // namespace

const Technique ridges{.role = Role::mark,
                       .properties = Property::normal | Property::principal | std::uint32_t(Property::directions),
                       .mark = draw};

}  // namespace smurf::techniques
