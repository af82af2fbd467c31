// Crosses along the principal directions (Beck, Farouki, Hinds 1986; Loeffelmann and Groeller 1999, Fig. 5a), spread
// evenly over the picture: warm along d1, cool along d2, of one length in space at one depth, so that they are
// foreshortened as the surface is. Where another sheet lies before them they are hidden.
#include <algorithm>
#include <cmath>

#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

constexpr double across = 30;   // crosses along the shorter side of the picture
constexpr double reach = 0.42;  // of an arm, in spacings

// Half of a stroke: from the point along the arm until it ends or the surface hides it.
void draw_arm(const Scene& scene, Ink& ink, const Projection& projection, const glm::dvec3& from, const glm::dvec3& arm,
              const glm::vec3& colour) {
  const glm::dvec2 start = projection.pixel(projection.in_view(from));
  const glm::dvec2 end = projection.pixel(projection.in_view(from + arm));
  const int steps = std::max(1, int(std::ceil(2 * glm::distance(start, end))));
  const double slack = 0.5 * glm::length(arm);  // a tangent leaves a curved surface
  for (int i = 0; i <= steps; i++) {
    const glm::dvec3 point = from + arm * (double(i) / steps);
    const glm::dvec2 place = projection.pixel(projection.in_view(point));
    const std::size_t hit = scene.hit_at(int(std::floor(place.x)), int(std::floor(place.y)));
    if (hit == Scene::none) return;
    const double depth = projection.in_view(point).z;
    if (projection.in_view(glm::dvec3(scene.hits.locations()[hit])).z < depth - slack) return;
    ink.dot(place.x, place.y, line_radius(scene), colour);
  }
}

void draw(const Scene& scene, Ink& ink) {
  static const glm::vec3 warm = to_linear({0.62f, 0.06f, 0.05f}), cool = to_linear({0.05f, 0.13f, 0.52f});
  const Projection projection(scene.camera);
  const double spacing = std::max(5.0, std::min(scene.width(), scene.height()) / across);
  for (double y = spacing / 2; y < scene.height(); y += spacing) {
    for (double x = spacing / 2; x < scene.width(); x += spacing) {
      const std::size_t hit = scene.hit_at(int(x), int(y));
      if (hit == Scene::none) continue;
      const SeenCurvature seen = seen_curvature(scene, hit);
      if (!seen.usable) continue;
      const glm::dvec3 point(scene.hits.locations()[hit]);
      const double length = reach * spacing * footprint(scene, hit);
      for (const double sign : {-1.0, 1.0}) {
        draw_arm(scene, ink, projection, point, sign * length * glm::dvec3(seen.d1), warm);
        draw_arm(scene, ink, projection, point, sign * length * glm::dvec3(seen.d2), cool);
      }
    }
  }
}

}  // namespace

const Technique crosses{.role = Role::mark,
                        .properties = Property::normal | Property::principal | std::uint32_t(Property::directions),
                        .mark = draw};

}  // namespace smurf::techniques
