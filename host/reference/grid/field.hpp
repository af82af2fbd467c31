// The continuous field of a sampled volume, in double precision.
//
// Index coordinates: sample (i, j, k) has index coordinates (i, j, k); the domain is [0, n-1] along each axis; cell c
// covers [c, c+1]. An axis with one sample has one cell of no extent, on which the field is constant.
//
// Samples are rounded to float first, as they are on devices (this matters for float64 and for wide
// integers); all that follows is done in double. Reconstructions:
//   trilinear    value from the 8 corners; gradient and Hessian are central differences of the samples at
//                nodes with a step of one cell, interpolated trilinearly; the neighbour that a boundary node lacks
//                is extrapolated linearly, so its first difference is one-sided and its second is 0
//   tricubic     cubic B-spline through the samples; coefficients by a tridiagonal solve along each axis
//   catmull_rom  cubic convolution with a = -1/2
// Cubic kernels see the data mirrored about the outer nodes.
//
// Samples that are not finite: the value is undefined in every cell that has one among the samples it is made
// from (2³ for trilinear, 4³ otherwise), derivatives in every cell that has one among its 4³. For the
// coefficients of the B-spline such samples count as 0.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "smurf/surface.hpp"
#include "smurf/volume.hpp"

namespace smurf {

struct Jet {
  double value;
  glm::dvec3 gradient;
  glm::dmat3 hessian;
};

class GridField {
 public:
  // Throws Error (memory) when the samples do not fit as doubles.
  GridField(const Volume& volume, Reconstruction reconstruction);

  // At points of the world. Points outside of the domain by less than 1e-6 cell, or by the rounding of a point that was
  // stored as float, are moved to its border; nothing for those farther out and where the field is undefined.
  std::optional<double> value(const glm::dvec3& point) const;
  std::optional<Jet> jet(const glm::dvec3& point) const;

  glm::dvec3 to_index(const glm::dvec3& point) const { return to_index_ * (point - origin_); }
  glm::dvec3 direction_to_index(const glm::dvec3& direction) const { return to_index_ * direction; }
  glm::dvec3 to_world(const glm::dvec3& index) const { return axes_ * index + origin_; }
  glm::ivec3 size() const { return size_; }
  glm::ivec3 cells() const { return cells_; }
  double shortest_step() const;  // length of the shortest cell edge
  std::size_t bytes() const;

  // What rays need: the field inside one cell, as a tensor product polynomial.
  struct Cell {
    std::array<double, 64> taps;  // less the offset; width³ of them, x fastest
    double lower, upper;          // bounds of the field in the cell, less the offset
    double scale;                 // largest |tap|
    double rounding;              // of the taps, as made from samples in double
  };
  int degree() const { return width_ == 2 ? 3 : 9; }  // along a line inside a cell
  bool defined(const glm::ivec3& cell) const {
    return undefined_.empty() || !(undefined_[cell_index(cell)] & no_value);
  }
  void load(const glm::ivec3& cell, double offset, Cell& out) const;
  double evaluate(const Cell& cell, const glm::dvec3& local) const;  // local in [0, 1]³

  // Bounds of the field over blocks of cells; `mixed` blocks have undefined cells.
  static constexpr int block_cells = 4;
  struct Block {
    double lower, upper;
    bool mixed;
  };
  const Block& block(const glm::ivec3& block) const {
    return blocks_[(std::size_t(block.z) * blocks_size_.y + block.y) * blocks_size_.x + block.x];
  }

 private:
  enum Undefined : std::uint8_t { no_value = 1, no_derivative = 2 };
  // Taps and weights along one axis: weight[order][tap], folded so that every index is valid.
  struct AxisWeights {
    std::array<int, 4> index;
    std::array<std::array<double, 4>, 3> weight;
  };

  template <int width>
  void load_taps(const glm::ivec3& cell, double offset, Cell& out) const;
  void read_samples(const Volume& volume);
  void mark_undefined(const std::vector<std::size_t>& not_finite);
  void solve_coefficients();
  void bound_blocks();
  Block bound_block(const glm::ivec3& block) const;
  void widen(double& lower, double& upper) const;
  std::size_t cell_index(const glm::ivec3& c) const { return (std::size_t(c.z) * cells_.y + c.y) * cells_.x + c.x; }
  std::size_t sample_index(int i, int j, int k) const { return (std::size_t(k) * size_.y + j) * size_.x + i; }
  // The cell of a point and its place in it; nothing outside of the domain.
  bool locate(const glm::dvec3& point, glm::ivec3& cell, glm::dvec3& local) const;
  AxisWeights axis_weights(int axis, int cell, double u) const;

  glm::ivec3 size_, cells_, blocks_size_{};
  glm::dmat3 axes_, to_index_;
  glm::dvec3 origin_;
  Reconstruction reconstruction_;
  int width_;                            // taps along an axis that a value is made from
  std::vector<double> values_;           // samples, or coefficients of the B-spline
  std::vector<std::uint8_t> undefined_;  // per cell; empty when all samples are finite
  std::vector<Block> blocks_;
};

}  // namespace smurf
