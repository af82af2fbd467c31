// Vectors on a regular grid, in double precision: trilinear, or tricubic (spline.hpp).
//
// A vector that is not usable makes the cells undefined that use it: of trilinear fields those that it is a corner of,
// of tricubic ones those that have it among their 4³ nodes. In the systems of the spline it counts as 0.
#include "flows/grid/definition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "flows/grid/vectors.hpp"
#include "flows/kinds.hpp"
#include "reference/flow/extrapolation.hpp"
#include "reference/flow/flow.hpp"
#include "reference/flow/spline.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using glm::ivec3;

class GridReference final : public ReferenceFlow {
 public:
  explicit GridReference(const GridFlow& flow)
      : size_(flow.grid.size),
        placement_(flow.grid.placement),
        to_index_(glm::inverse(flow.grid.placement.axes)),
        bounds_(flow.bounds()),
        tricubic_(flow.reconstruction == VectorReconstruction::tricubic) {
    nodes_.reserve(flow.grid.vectors.size());
    finite_.reserve(flow.grid.vectors.size());
    for (const glm::vec3& v : flow.grid.vectors) {
      finite_.push_back(is_usable(v) ? 1 : 0);
      nodes_.push_back(finite_.back() != 0 ? dvec3(v) : dvec3(0.0));
    }
    if (tricubic_) spline_ = LatticeSpline(size_, nodes_, {false, false, false});
    const glm::dmat3& axes = placement_.axes;
    shortest_ = std::min({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
  }

  Bounds bounds() const override { return bounds_; }
  bool has_cells() const override { return true; }
  double size(std::int32_t) const override { return shortest_; }

  ReferencePlace find(const dvec3& point, double slack) const override {
    ReferencePlace place;
    if (!is_finite(point)) return place;
    const dvec3 index = to_index_ * (point - placement_.origin);
    ivec3 cell;
    for (int axis = 0; axis < 3; axis++) {
      // The distance from a face of the grid is that in index coordinates over the size of their gradient.
      const dvec3 gradient(to_index_[0][axis], to_index_[1][axis], to_index_[2][axis]);
      const double room = slack * glm::length(gradient);
      if (index[axis] < -room || index[axis] > size_[axis] - 1 + room) return place;
      cell[axis] = std::clamp(int(std::floor(index[axis])), 0, size_[axis] - 2);
    }
    place.piece = cell.x + (size_.x - 1) * (cell.y + (size_.y - 1) * cell.z);
    place.local = index - dvec3(cell);
    place.status = defined(cell) ? FlowStatus::inside : FlowStatus::undefined;
    return place;
  }

  bool locate(std::int32_t piece, const dvec3& point, dvec3& local) const override {
    local = to_index_ * (point - placement_.origin) - dvec3(cell_of(piece));
    return true;
  }

  dvec3 value(std::int32_t piece, const dvec3&, const dvec3& local) const override {
    const ivec3 cell = cell_of(piece);
    if (tricubic_) return spline_.at(cell, local, nullptr);
    std::array<dvec3, 8> corners;
    for (int c = 0; c < 8; c++) corners[std::size_t(c)] = nodes_[node(cell + ivec3(c & 1, c >> 1 & 1, c >> 2))];
    return trilinear(corners, local, nullptr);
  }

 private:
  std::size_t node(const ivec3& p) const {
    return (std::size_t(p.z) * std::size_t(size_.y) + std::size_t(p.y)) * std::size_t(size_.x) + std::size_t(p.x);
  }
  ivec3 cell_of(std::int32_t piece) const {
    const int rows = piece / (size_.x - 1);
    return {piece % (size_.x - 1), rows % (size_.y - 1), rows / (size_.y - 1)};
  }
  bool defined(const ivec3& cell) const {
    const ivec3 reach(tricubic_ ? 1 : 0);
    const ivec3 low = glm::max(cell - reach, ivec3(0)), high = glm::min(cell + 1 + reach, size_ - 1);
    for (int k = low.z; k <= high.z; k++)
      for (int j = low.y; j <= high.y; j++)
        for (int i = low.x; i <= high.x; i++)
          if (finite_[node({i, j, k})] == 0) return false;
    return true;
  }

  ivec3 size_;
  GridPlacement placement_;
  glm::dmat3 to_index_;
  Bounds bounds_;
  bool tricubic_;
  double shortest_ = 0;
  std::vector<dvec3> nodes_;
  std::vector<std::uint8_t> finite_;
  LatticeSpline spline_;
};

}  // namespace

std::shared_ptr<const ReferenceFlow> refer_grid_flow(const VectorFieldDefinition& definition) {
  return std::make_shared<GridReference>(dynamic_cast<const GridFlow&>(definition));
}

}  // namespace smurf
