// Which borders of pieces are one edge, which corners one vertex, and which borders are collapsed to a point.
//
// Sides of a piece are numbered u = least, u = greatest, v = least, v = greatest; corners (least u, least v), (greatest
// u, least v), (least u, greatest v), (greatest u, greatest v).
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "patches/piece_source.hpp"

namespace smurf {

constexpr std::uint32_t no_edge = 0xffffffffu;

struct PieceBorders {
  // Numbers of edges. Two sides with the same number are one edge, of two pieces or of the piece with itself; no_edge
  // where the surface ends, or the side is collapsed.
  std::array<std::uint32_t, 4> edges{no_edge, no_edge, no_edge, no_edge};
  // Whether the normals x_u × x_v on both sides of that edge point to opposite sides of the surface (the seam of a
  // Klein bottle).
  std::array<bool, 4> turned{};
  std::array<std::uint32_t, 4> vertices{};  // numbers of vertices, the same where corners meet
  std::array<bool, 4> collapsed{};          // the side is one point, and its two corners one vertex
};

// A vertex where sides are collapsed.
struct Pole {
  std::uint32_t vertex = 0;
  glm::dvec3 position{0.0};
  // Limits, the same from wherever the vertex is approached; for the orientation of the piece that comes first.
  bool has_normal = false, has_curvature = false;
  glm::dvec3 normal{0.0};
  glm::dmat3 shape{0.0};  // dn along the surface, as in kernels/common/frame.inc
};

struct PatchTopology {
  std::vector<PieceBorders> pieces;
  std::vector<Pole> poles;     // in the order of their vertices
  std::size_t edges = 0;       // that two sides share
  std::size_t open_sides = 0;  // where the surface ends
  std::size_t vertices = 0;
  std::size_t branching_sides = 0;  // of the open ones: three or more lie at one place, and none are taken for one edge
  double greatest_gap = 0;          // between sides that are taken for one edge
};

// Sides that agree within 1e-6 of `extent`, the greatest side of the bounds of all, at 9 places are one edge; a side
// that stays within 1e-7 of it is collapsed. `closed` tells of a surface of one piece that its two sides of least and
// greatest u, or v, are one edge, however far they are apart.
PatchTopology join_pieces(const PieceSource& source, double extent, std::array<bool, 2> closed = {});

}  // namespace smurf
