// Section curves of meshes: polylines, exact up to the rounding of their corners, from triangle to triangle.
//
// Which edge a triangle is left by follows from the sides of the plane that its corners are on alone; a corner in the
// plane counts to the positive side, as if the plane were moved a little. So no corner stops the curve or forks it.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "reference/mesh/brute_force.hpp"
#include "reference/walk/section.hpp"
#include "smurf/mesh.hpp"

namespace smurf {

class MeshSections {
 public:
  explicit MeshSections(const Mesh& mesh);

  // From a point on the mesh: start.location is that of `at`. The outcome has the place as part, u and v. Where a point
  // is on an edge or a corner, the curve goes into the triangle whose part of the curve is best aligned with the
  // direction. At an edge of more than two triangles it goes on into the one in which it turns least.
  SectionEnd follow(const SectionStart& start, const MeshPoint& at) const;

  std::size_t bytes() const;

 private:
  struct Edge {
    std::uint32_t low, high, face;
    friend bool operator<(const Edge& a, const Edge& b) {
      if (a.low != b.low) return a.low < b.low;
      return a.high != b.high ? a.high < b.high : a.face < b.face;
    }
  };
  struct Exit {  // of a triangle: the edge from `from` to `to`, of which the curve leaves it
    std::uint32_t from, to;
    glm::dvec3 location;
  };
  struct Plane {
    glm::dvec3 origin, normal;
  };

  glm::dvec3 vertex(std::uint32_t number) const { return glm::dvec3(mesh_.vertices()[number]); }
  double side(const Plane& plane, std::uint32_t vertex_number) const;
  glm::dvec3 crossing(const Plane& plane, std::uint32_t a, std::uint32_t b) const;
  std::vector<Exit> exits(const Plane& plane, std::uint32_t face) const;
  std::vector<std::uint32_t> faces_at(const MeshPoint& at) const;
  std::optional<std::uint32_t> next_face(const Plane& plane, std::uint32_t face, const Exit& exit,
                                         const glm::dvec3& heading) const;
  Exit exit_of(const Plane& plane, std::uint32_t face, const Exit& entry) const;
  SectionEnd place(std::uint32_t face, const glm::dvec3& location, WalkStatus outcome) const;

  Mesh mesh_;
  std::vector<Edge> edges_;              // sorted; one for each side of each triangle
  std::vector<std::uint32_t> first_of_;  // of each vertex, in faces_of_, and one more
  std::vector<std::uint32_t> faces_of_;
};

}  // namespace smurf
