// Patches cut at their knots into Bézier pieces, in double precision, and what is known of a piece at a point.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "patches/patch.hpp"

namespace smurf {

// A Bézier patch over [lower, upper] in the parameters of its patch.
struct BezierPiece {
  std::uint32_t patch = 0;
  std::array<int, 2> degree{};
  glm::dvec2 lower{0.0}, upper{1.0};
  std::vector<glm::dvec4> points{};  // homogeneous, u runs fastest
};

// The pieces of a valid patch, v by v and u by u. Pieces that meet in a knot of no more than degree times share their
// border's points to the bit. Control points are values of the blossom (Ramshaw 1989; Piegl, Tiller 1997, §5.4), so
// that knots need not be clamped.
std::vector<BezierPiece> bezier_pieces(const Patch& patch, std::uint32_t number);

// The surface with its derivatives by u and v, in the parameters of the patch.
struct PatchPoint {
  glm::dvec3 position{0.0}, u{0.0}, v{0.0}, uu{0.0}, uv{0.0}, vv{0.0};
};

// Over [0, 1]² instead of [lower, upper], also with regard to the derivatives.
PatchPoint evaluate_unit(const BezierPiece& piece, double u, double v);

// At u, v, which may lie outside of the piece. Not finite where the weight vanishes.
PatchPoint evaluate(const BezierPiece& piece, double u, double v);

// The same surface with the given degrees, which are not below its own.
BezierPiece elevated(const BezierPiece& piece, int degree_u, int degree_v);

}  // namespace smurf
