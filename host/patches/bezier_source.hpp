// Bézier pieces of patches as a source of pieces: each over [0, 1]², with bounds by the hulls of control points.
#pragma once

#include <span>
#include <vector>

#include "patches/bezier.hpp"
#include "patches/piece_source.hpp"

namespace smurf {

class BezierSource : public PieceSource {
 public:
  // Valid patches. Where the control points of two borders are the same within `weld` times the extent, with the same
  // weights, both get the same points to the bit; so do all points of a border that is collapsed within a tenth of it.
  explicit BezierSource(std::span<const Patch> patches, double weld = 1e-6);
  // Pieces as they are.
  explicit BezierSource(std::vector<BezierPiece> pieces);

  std::size_t size() const override { return pieces_.size(); }
  ParameterBox range(std::size_t) const override { return {}; }
  PatchPoint at(std::size_t piece, double u, double v) const override { return evaluate_unit(pieces_[piece], u, v); }
  std::optional<PieceBounds> bounds(std::size_t piece, const ParameterBox& box) const override;

  // The map to the patch's own parameters is linear, from [0, 1]² to [lower, upper].
  const std::vector<BezierPiece>& pieces() const { return pieces_; }
  // The greatest of all pieces: devices have all pieces elevated to these.
  std::array<int, 2> degree() const { return degree_; }
  // Whether all weights are 1.
  bool polynomial(std::size_t piece) const { return nets_[piece].polynomial; }
  // What the device's control points are relative to: the middle of the hull, a float.
  glm::dvec3 centre(std::size_t piece) const { return nets_[piece].centre; }

 private:
  // Control points of a derivative of the homogeneous surface; none where it is 0.
  struct Net {
    std::array<int, 2> degree{};
    std::vector<glm::dvec4> points{};
    glm::dvec4 greatest{0.0};  // magnitudes
  };
  struct Nets {
    bool polynomial = true;
    Net s, u, v, uu, uv, vv;
    glm::dvec3 centre{0.0}, reach{0.0};  // the greatest distances of homogeneous points from w times the centre
    double weight = 1;                   // the greatest
  };
  struct Hull;
  void make_all_nets();
  static Nets make_nets(const BezierPiece& piece);
  static Hull hull(const Net& net, const ParameterBox& box, const glm::dvec3& origin);

  std::vector<BezierPiece> pieces_;
  std::vector<Nets> nets_;
  std::array<int, 2> degree_{};
};

}  // namespace smurf
