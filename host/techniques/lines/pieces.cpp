#include "techniques/lines/pieces.hpp"

#include <algorithm>

namespace smurf {

void LinePieces::add_cubic(const glm::dvec3& p, const glm::dvec3& dp, const glm::dvec3& q, const glm::dvec3& dq,
                           const glm::vec3& from_colour, const glm::vec3& to_colour) {
  constexpr double piece = 1.5;  // pixels
  constexpr double most = 512;
  const double depth = project_.in_view(0.5 * (p + q)).z;
  if (!(depth > nearest_)) return;
  const double length = std::max(glm::length(q - p), (glm::length(dp) + glm::length(dq)) / 3);
  const int count = int(std::min(length * project_.pixels_per_unit(depth) / piece, most)) + 1;
  glm::dvec3 begin = p;
  for (int i = 1; i <= count; i++) {
    const double s = double(i) / count, r = 1 - s;
    // Hermite's form; the last piece ends at q without rounding.
    const glm::dvec3 end =
        i == count ? q : (1 + 2 * s) * r * r * p + s * r * r * dp + (3 - 2 * s) * s * s * q - r * s * s * dq;
    add(begin, end, radius_, glm::mix(from_colour, to_colour, float(double(i - 1) / count)),
        glm::mix(from_colour, to_colour, float(s)), true);
    begin = end;
  }
}

void LinePieces::add_box(const Bounds& box, const glm::vec3& colour) {
  constexpr int parts = 64;
  for (int axis = 0; axis < 3; axis++) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (int corner = 0; corner < 4; corner++) {
      glm::dvec3 p = box.lower;
      if ((corner & 1) != 0) p[b] = box.upper[b];
      if ((corner & 2) != 0) p[c] = box.upper[c];
      glm::dvec3 q = p;
      q[axis] = box.upper[axis];
      for (int i = 0; i < parts; i++)
        add(glm::mix(p, q, double(i) / parts), glm::mix(p, q, (i + 1.0) / parts), 0, colour, colour, false);
    }
  }
}

void LinePieces::add(const glm::dvec3& p, const glm::dvec3& q, double radius, const glm::vec3& from_colour,
                     const glm::vec3& to_colour, bool lit) {
  constexpr double thinnest = 0.55;  // radius in pixels: thinner lines would break up
  const glm::dvec3 a = project_.in_view(p), b = project_.in_view(q);
  if (!(std::min(a.z, b.z) > nearest_)) return;
  const double length = glm::length(b - a);
  TubePiece piece;
  piece.from = project_.pixel(a);
  piece.to = project_.pixel(b);
  piece.from_depth = float(a.z);
  piece.to_depth = float(b.z);
  piece.from_radius = float(std::max(thinnest, radius * project_.pixels_per_unit(a.z)));
  piece.to_radius = float(std::max(thinnest, radius * project_.pixels_per_unit(b.z)));
  piece.units_per_pixel = float(1 / project_.pixels_per_unit(0.5 * (a.z + b.z)));
  piece.tangent = length > 0 ? (b - a) / length : glm::dvec3(0, 0, 1);
  piece.to_eye = project_.is_parallel() ? glm::dvec3(0, 0, -1) : -glm::normalize(0.5 * (a + b));
  piece.from_colour = from_colour;
  piece.to_colour = to_colour;
  piece.lit = lit;
  pieces_.push_back(piece);
}

}  // namespace smurf
