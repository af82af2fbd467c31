#include "techniques/curvature/draw_lines.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "smurf/rays.hpp"
#include "techniques/canvas.hpp"

namespace smurf {
namespace {

constexpr double strokes_across = 250;  // of the picture
constexpr float before = 1e-3f;         // of the way from the eye, within which a hit is the line's own place

// Whether nothing lies before each row.
std::vector<bool> visible_rows(const Interrogator& query, const Camera& camera, const CurvatureLines& lines) {
  RayBatch rays(lines.positions.size());
  const glm::vec3 eye(camera.eye);
  for (std::size_t i = 0; i < rays.size(); i++) rays.set(i, {eye, lines.positions[i] - eye, 0, 1 - before});
  const HitList hits = query.cast(rays, {.hits = Hits::first});
  std::vector<bool> visible(rays.size());
  for (std::size_t i = 0; i < rays.size(); i++) visible[i] = hits.offsets()[i] == hits.offsets()[i + 1];
  return visible;
}

// A disc with soft edges.
void dot(Canvas& canvas, const glm::dvec2& centre, double radius, const glm::vec3& colour) {
  const int reach = int(std::ceil(radius)) + 1, x = int(std::floor(centre.x)), y = int(std::floor(centre.y));
  for (int j = y - reach; j <= y + reach; j++) {
    for (int i = x - reach; i <= x + reach; i++) {
      const double away = glm::distance(centre, glm::dvec2(i + 0.5, j + 0.5));
      const double covered = std::clamp(radius + 0.5 - away, 0.0, 1.0);
      if (covered > 0) canvas.blend(i, j, colour, float(covered));
    }
  }
}

}  // namespace

void draw_curvature_lines(const Interrogator& query, const Camera& camera, const CurvatureLines& lines,
                          const glm::vec3& colour, Image& image) {
  const std::vector<bool> visible = visible_rows(query, camera, lines);
  const Projection projection(camera);
  const double radius = std::max(0.6, 0.5 * image.width / strokes_across);
  Canvas canvas(image);
  for (std::size_t line = 0; line < lines.size(); line++) {
    for (std::size_t row = lines.offsets[line]; row + 1 < lines.offsets[line + 1]; row++) {
      if (!visible[row] || !visible[row + 1]) continue;
      const glm::dvec3 from = projection.in_view(glm::dvec3(lines.positions[row])),
                       to = projection.in_view(glm::dvec3(lines.positions[row + 1]));
      if (!(from.z > 0 && to.z > 0)) continue;
      const glm::dvec2 a = projection.pixel(from), b = projection.pixel(to);
      const int steps = std::max(1, int(std::ceil(glm::distance(a, b) / radius)));
      for (int i = 0; i <= steps; i++) dot(canvas, glm::mix(a, b, double(i) / steps), radius, colour);
    }
  }
}

}  // namespace smurf
