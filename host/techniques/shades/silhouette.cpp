// Outlines: where the surface begins before nothing or before a farther sheet of itself. There n·d = 0 on smooth
// surfaces; found by jumps of depth between rays beside each other, it holds for borders and creases, too.
#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

void draw(const Scene& scene, Ink& ink) {
  const glm::vec3 colour(0.01f);
  const double radius = 1.4 * line_radius(scene);
  for (int y = 0; y < scene.height(); y++) {
    for (int x = 0; x < scene.width(); x++) {
      const std::size_t hit = scene.hit_at(x, y);
      if (hit == Scene::none) continue;
      bool outline = false;
      for (const glm::ivec2 step : {glm::ivec2(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const glm::ivec2 place = glm::ivec2(x, y) + step;
        if (place.x < 0 || place.y < 0 || place.x >= scene.width() || place.y >= scene.height()) continue;
        const std::size_t other = scene.hit_at(place.x, place.y);
        outline |=
            other == Scene::none || (scene.hits.t()[hit] < scene.hits.t()[other] && depth_jumps(scene, hit, other));
      }
      if (outline) ink.dot(x + 0.5, y + 0.5, radius, colour);
    }
  }
}

}  // namespace

const Technique silhouette{.role = Role::mark, .properties = std::uint32_t(Property::normal), .mark = draw};

}  // namespace smurf::techniques
