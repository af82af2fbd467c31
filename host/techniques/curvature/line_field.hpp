// The principal directions of a surface as a line field: at points next to the surface, which are put back on it along
// a normal.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "smurf/interrogator.hpp"

namespace smurf {

// A point next to the surface: what is meant is the surface point nearest to it on the line along `normal`, `off` away
// from it at most, with a normal to the same side if there is one.
struct Guess {
  glm::dvec3 point, normal;
  double off;
};

struct LinePlace {
  bool found = false;    // there is a surface point
  bool defined = false;  // and it has principal directions or is umbilic
  bool umbilic = false;  // curvatures agree to rounding, or to a part of the extent's curvature
  glm::dvec3 position{0.0}, normal{0.0}, direction{0.0};
  float k1 = 0, k2 = 0;
};

class LineField {
 public:
  // `extent`: a length that the surface has.
  LineField(const Interrogator& query, int principal, double extent)
      : query_(query), principal_(principal), extent_(extent) {}

  std::vector<LinePlace> at(std::span<const Guess> guesses) const;
  // Of points of which no normal is known.
  std::vector<LinePlace> near(std::span<const glm::vec3> points, double reach) const;

 private:
  const Interrogator& query_;
  const int principal_;
  const double extent_;
};

// The direction with the sign that goes on along `before`.
inline glm::dvec3 along_line(const glm::dvec3& direction, const glm::dvec3& before) {
  return glm::dot(direction, before) < 0 ? -direction : direction;
}

// The way on from an umbilic point.
struct UmbilicExit {
  enum class Kind { none, region, index } kind = Kind::none;  // none: it has no index, region: all around is umbilic
  int twice_index = 0;
  bool goes_on = false;
  LinePlace place;       // on the circle
  glm::dvec3 direction;  // out of the umbilic
};
// Looks at the field on a circle of `radius` about `centre`, into which a line runs along `way`.
UmbilicExit exit_of(const LineField& field, const LinePlace& centre, const glm::dvec3& way, double radius);

}  // namespace smurf
