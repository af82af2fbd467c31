// Curvature-directed strokes (after Interrante, Fuchs, Pizer 1997): short strokes that follow the direction of the
// stronger curvature from ray to ray, darker where curvature is stronger. As they are followed in the picture, from hit
// to hit, they lie on the surface, and end at outlines and where directions lose their meaning.
#include <algorithm>
#include <cmath>

#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

constexpr double across = 62;   // strokes along the shorter side of the picture
constexpr double reach = 0.85;  // of half a stroke, in spacings

struct Follower {
  const Scene& scene;
  Ink& ink;
  const Projection& projection;
  bool first;  // along d1, else along d2
  float coverage;

  void follow(glm::dvec2 place, glm::dvec2 heading, double length) const {
    static const glm::vec3 colour = to_linear({0.13f, 0.10f, 0.12f});
    constexpr double step = 0.5;
    std::size_t before = Scene::none;
    const glm::dvec2 start = heading / std::max(glm::length(heading), 1e-30);
    for (double gone = 0; gone < length; gone += step) {
      const std::size_t hit = scene.hit_at(int(std::floor(place.x)), int(std::floor(place.y)));
      if (hit == Scene::none) return;
      if (before != Scene::none && hit != before && depth_jumps(scene, hit, before)) return;
      const SeenCurvature seen = seen_curvature(scene, hit);
      if (!seen.usable) return;
      ink.dot(place.x, place.y, line_radius(scene) * (1 - 0.4 * gone / length), colour, coverage);
      const glm::dvec3 point(scene.hits.locations()[hit]), direction(first ? seen.d1 : seen.d2);
      const double small = 0.5 * footprint(scene, hit);
      glm::dvec2 ahead =
          projection.pixel(projection.in_view(point + small * direction)) - projection.pixel(projection.in_view(point));
      // Foreshortened in the picture, as the surface is.
      if (glm::dot(ahead, heading) < 0) ahead = -ahead;
      const double shortening = 2 * glm::length(ahead);
      if (shortening < 0.05) return;
      heading = glm::normalize(ahead);
      if (glm::dot(heading, start) < 0.5) return;  // where directions turn as fast, they tell of noise
      place += step * heading;
      gone += step * (1 / std::min(1.0, shortening) - 1);
      before = hit;
    }
  }
};

void draw(const Scene& scene, Ink& ink) {
  const Projection projection(scene.camera);
  std::vector<float> strengths(scene.hits.size());
  for (std::size_t i = 0; i < strengths.size(); i++) strengths[i] = curvedness(scene.values, i);
  const float full = usual_greatest(strengths);
  const double spacing = std::max(4.0, std::min(scene.width(), scene.height()) / across);
  int row = 0;
  for (double y = spacing / 2; y < scene.height(); y += spacing, row++) {
    for (double x = row % 2 == 0 ? spacing / 2 : spacing; x < scene.width(); x += spacing) {
      const std::size_t hit = scene.hit_at(int(x), int(y));
      if (hit == Scene::none) continue;
      const SeenCurvature seen = seen_curvature(scene, hit);
      if (!seen.usable || !(full > 0)) continue;
      const float coverage = 0.2f + 0.8f * std::min(1.0f, strengths[hit] / full);
      const Follower follower{scene, ink, projection, std::abs(seen.k1) >= std::abs(seen.k2), coverage};
      const glm::dvec3 point(scene.hits.locations()[hit]);
      const glm::dvec3 direction(follower.first ? seen.d1 : seen.d2);
      const glm::dvec2 heading = projection.pixel(projection.in_view(point + 0.5 * footprint(scene, hit) * direction)) -
                                 projection.pixel(projection.in_view(point));
      follower.follow({x, y}, heading, reach * spacing);
      follower.follow({x, y}, -heading, reach * spacing);
    }
  }
}

}  // namespace

const Technique strokes{.role = Role::mark,
                        .properties = Property::normal | Property::principal | std::uint32_t(Property::directions),
                        .mark = draw};

}  // namespace smurf::techniques
