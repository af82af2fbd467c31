// Pieces of surfaces s(u, v), whoever makes them: what the makers of leaves (patches/leaves.hpp) and of borders
// (patches/topology.hpp) know of a piece, in double precision. Pieces of patches (bezier_source.hpp) and of expressions
// (expression_source.hpp) are such sources; cells between streamlines can be.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>

#include "patches/bezier.hpp"

namespace smurf {

// A box of a piece's own parameters.
struct ParameterBox {
  glm::dvec2 lower{0.0}, upper{1.0};
};

struct SpaceBox {
  glm::dvec3 lower{0.0}, upper{0.0};
};

// What holds everywhere in a box of parameters, component by component. In real arithmetic, rounded outwards.
struct PieceBounds {
  glm::dvec3 lower{0.0}, upper{0.0};     // of the position
  glm::dvec3 uu{0.0}, uv{0.0}, vv{0.0};  // greatest magnitudes of the second derivatives
  glm::dvec3 error{0.0};                 // by how much at most a device, in floats, is off in the position
};

class PieceSource {
 public:
  virtual ~PieceSource() = default;
  virtual std::size_t size() const = 0;
  // Where the piece lies, in its own parameters.
  virtual ParameterBox range(std::size_t piece) const = 0;
  // The surface and its derivatives by the piece's own parameters, also beyond the range where it is defined there;
  // not finite where it is undefined.
  virtual PatchPoint at(std::size_t piece, double u, double v) const = 0;
  // Nothing where the piece is undefined somewhere in the box, or where no bound is known. May be called by threads at
  // once.
  virtual std::optional<PieceBounds> bounds(std::size_t piece, const ParameterBox& box) const = 0;
  // Bounds of the position alone, also where nothing is known of the derivatives (a crease, a square root at 0), and
  // where it is undefined in a part of the box. Lower exceeds upper where it is undefined throughout.
  virtual std::optional<SpaceBox> positions(std::size_t piece, const ParameterBox& box) const {
    const std::optional<PieceBounds> known = bounds(piece, box);
    if (!known) return std::nullopt;
    return SpaceBox{known->lower, known->upper};
  }
};

}  // namespace smurf
