// Lines as pieces of tubes, each a pixel or two long in the picture.
#pragma once

#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "smurf/camera.hpp"
#include "techniques/lines/tubes.hpp"

namespace smurf {

class LinePieces {
 public:
  // `radius` is that of tubes, in units of space; what is nearer than `nearest` along the view is left out.
  LinePieces(const Camera& camera, double radius, double nearest)
      : project_(camera), radius_(radius), nearest_(nearest) {}

  // The cubic from p to q, whose derivatives by its parameter, 0 to 1, are dp and dq.
  void add_cubic(const glm::dvec3& p, const glm::dvec3& dp, const glm::dvec3& q, const glm::dvec3& dq,
                 const glm::vec3& from_colour, const glm::vec3& to_colour);
  // The edges of a box, in lines of a pixel or so without light.
  void add_box(const Bounds& box, const glm::vec3& colour);

  std::vector<TubePiece> take() { return std::move(pieces_); }

 private:
  void add(const glm::dvec3& p, const glm::dvec3& q, double radius, const glm::vec3& from_colour,
           const glm::vec3& to_colour, bool lit);

  Projection project_;
  double radius_, nearest_;
  std::vector<TubePiece> pieces_;
};

}  // namespace smurf
