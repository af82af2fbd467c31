// Pieces cut into leaves: boxes of parameters in which the surface is nearly flat, so that a few operations exclude, or
// prove to be unique, a root of any ray there.
//
// Scaled to [-1, 1]², a leaf is a centre m, tangents a and b, and a remainder e:
//   |s_x(x, y) - a| + |s_y(x, y) - b| <= e, component by component, for |x|, |y| <= leaf_reach
// where e is made of bounds of second derivatives, so that the leaf itself leaves its plane by e/(2·leaf_reach) at most
// (Krawczyk 1969; Toth 1985; Srijuntongsiri, Vavasis 2006, reduced to one constant for each leaf).
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "patches/piece_source.hpp"
#include "patches/topology.hpp"

namespace smurf {

constexpr double leaf_reach = 1.25;

enum class LeafKind : std::uint32_t {
  regular,
  // Nothing is known of it but the box in space: undefined somewhere, or of no size to work with.
  open,
  // Next to a collapsed side: the triangle of m (the vertex), m + a and m + b, which reaches cap_reach times as far
  // across the leaf as the leaf itself. a is at the least, b at the greatest of the parameter along the side.
  cap,
};
constexpr double cap_reach = 1.2;

struct PatchLeaf {
  LeafKind kind = LeafKind::regular;
  std::uint32_t piece = 0;
  int side = 0;                       // of a cap: which side of the piece is collapsed (topology.hpp)
  glm::dvec2 centre{0.0}, half{0.0};  // of the box, in the piece's own parameters
  glm::dvec3 m{0.0}, a{0.0}, b{0.0}, e{0.0};
  glm::dvec3 error{0.0};              // PieceBounds::error there
  glm::dvec3 lower{0.0}, upper{0.0};  // bounds in space of the leaf itself (of a cap: of its triangle, too)
};

// A leaf is split while e is longer than this part of |a| or |b|. Of rays from all directions that cross the leaf about
// 1 % are then too oblique to be certified there; with 0.35 it is 3 % of a third as many leaves, with 0.7 11 % of a
// ninth (teapot, torus). The first is the fastest on devices: 28 million camera rays of the teapot a second, against 22
// with 0.4. Within an eighth of a piece from a collapsed side, e is mostly due to the tangent along the side, which
// falls to 0 there: the first limit would make far more leaves.
constexpr double largest_remainder = 0.2, largest_graded_remainder = 0.5;
// Of `extent`: no leaf is wider; caps begin where less is left to the collapsed side; smaller leaves are not split.
constexpr double widest_leaf = 0.125, cap_size = 2e-5, smallest_leaf = 1e-6;
// Caps may be as large as widest_cap where the surface leaves their plane by no more than flat_cap half way out, and as
// large as small_cap where it does so by less than a five-hundredth of their size.
constexpr double widest_cap = 5e-4, flat_cap = 1e-8, small_cap = 1e-4;

// Leaves of all pieces, those of a piece after each other. `extent` is the greatest side of the bounds of all. Leaves
// are split at half, so the leaves of a piece cover its range without gaps, but for boxes in which the surface is
// defined nowhere. Where it is undefined beyond the range, the inequality above holds within the range. Leaves of no
// size (at singular places) stay regular with a greater e. Calls `progress` as build_bvh does.
std::vector<PatchLeaf> make_leaves(const PieceSource& source, const PatchTopology& topology, double extent,
                                   const std::function<void(std::size_t done, std::size_t total)>& progress = {});

// What bounds the remainder of a box: over leaf_reach times the box, or what of that lies within the range where the
// piece is undefined beyond it; nothing where there are no bounds.
std::optional<PieceBounds> leaf_bounds(const PieceSource& source, std::size_t piece, const glm::dvec2& centre,
                                       const glm::dvec2& half);
// The remainder e that these bounds make, of any box within.
glm::dvec3 leaf_remainder(const PieceBounds& bounds, const glm::dvec2& half);

}  // namespace smurf
