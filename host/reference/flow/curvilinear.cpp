// Vectors on curvilinear blocks, in double precision.
//
// The cells that a point may lie in are those whose boxes contain it. In each of them, six tetrahedra give a place to
// begin at, and Newton's method, damped and kept regular, the coordinates in the cell. Where it does not come to an end
// there it begins again from eight places more. The first cell that contains the point and is not blanked has it; a
// blanked one only where there is no other.
//
// Tricubic: places and vectors are splines of the index coordinates (spline.hpp), periodic along an axis whose first
// and last plane of nodes coincide. A vector that is not finite makes the cells undefined that use it, as in grids.
#include "flows/curvilinear/definition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "flows/kinds.hpp"
#include "reference/flow/boxes.hpp"
#include "reference/flow/extrapolation.hpp"
#include "reference/flow/flow.hpp"
#include "reference/flow/spline.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using glm::ivec3;

constexpr double in_cell = 1e-11;  // of local coordinates, for points on faces
constexpr double seam = 1e-6;      // of the block's extent, within which planes of nodes coincide
// How far beyond a cell its map is followed.
constexpr double farthest = 2;

struct Block {
  ivec3 size;
  std::int32_t first = 0;  // cell
  std::vector<dvec3> points, vectors;
  std::vector<std::uint8_t> blanked, finite;
  std::array<bool, 3> periodic{};
  LatticeSpline places, values;

  std::size_t node(const ivec3& p) const {
    return (std::size_t(p.z) * std::size_t(size.y) + std::size_t(p.y)) * std::size_t(size.x) + std::size_t(p.x);
  }
  std::int32_t cells() const { return (size.x - 1) * (size.y - 1) * (size.z - 1); }
  ivec3 cell_of(std::int32_t inner) const {
    const int rows = inner / (size.x - 1);
    return {inner % (size.x - 1), rows % (size.y - 1), rows / (size.y - 1)};
  }
  std::array<dvec3, 8> corners(const std::vector<dvec3>& of, const ivec3& cell) const {
    std::array<dvec3, 8> result;
    for (int c = 0; c < 8; c++) result[std::size_t(c)] = of[node(cell + ivec3(c & 1, c >> 1 & 1, c >> 2))];
    return result;
  }
};

class CurvilinearReference final : public ReferenceFlow {
 public:
  explicit CurvilinearReference(const CurvilinearFlow& flow)
      : bounds_(flow.bounds()), tricubic_(flow.reconstruction == VectorReconstruction::tricubic), tree_({}) {
    std::int32_t first = 0;
    std::vector<BoxTree::Box> boxes;
    for (const CurvilinearBlock& given : flow.blocks) {
      blocks_.push_back(block_of(given, first));
      const Block& block = blocks_.back();
      first += block.cells();
      for (std::int32_t i = 0; i < block.cells(); i++) {
        const ivec3 cell = block.cell_of(i);
        BoxTree::Box box;
        const std::array<dvec3, 8> corners = block.corners(block.points, cell);
        box.lower = box.upper = corners[0];
        if (tricubic_) block.places.box(cell, box.lower, box.upper);
        for (const dvec3& corner : corners) {
          box.lower = glm::min(box.lower, corner);
          box.upper = glm::max(box.upper, corner);
        }
        boxes.push_back(box);
        sizes_.push_back(size_of(block, cell));
      }
    }
    tree_ = BoxTree(std::move(boxes));
  }

  Bounds bounds() const override { return bounds_; }
  bool has_cells() const override { return true; }
  double size(std::int32_t piece) const override { return sizes_[std::size_t(piece)]; }

  ReferencePlace find(const dvec3& point, double slack) const override {
    thread_local std::vector<std::int32_t> candidates;
    ReferencePlace blanked;
    if (!is_finite(point)) return blanked;
    tree_.find(point, std::max(slack, 1e-14 * greatest(bounds_.upper - bounds_.lower)), candidates);
    if (tricubic_ && blocks_.size() > 1) prefer_block_of_cells(point, candidates);
    for (int pass = 0; pass < (slack > 0 ? 2 : 1); pass++) {
      for (const std::int32_t number : candidates) {
        dvec3 local;
        if (!holds(number, point, pass == 0 ? 0 : slack, tricubic_, local)) continue;
        const Block& block = block_with(number);
        const ivec3 cell = block.cell_of(number - block.first);
        ReferencePlace place{FlowStatus::inside, number, local};
        if (is_blanked(block, cell)) {
          place.status = FlowStatus::blanked;
          if (blanked.piece < 0) blanked = place;
          continue;
        }
        if (!defined(block, cell)) place.status = FlowStatus::undefined;
        return place;
      }
      if (blanked.piece >= 0) break;
    }
    return blanked;
  }

  bool locate(std::int32_t piece, const dvec3& point, dvec3& local) const override {
    const Block& block = block_with(piece);
    const ivec3 cell = block.cell_of(piece - block.first);
    const Cell geometry = cell_at(block, cell, tricubic_);
    // The guess may be of a place far off, or meaningless.
    if (!is_finite(local) || greatest(local - 0.5) > farthest) local = dvec3(0.5);
    dvec3 start = local;
    if (newton(geometry, point, start)) {
      local = start;
      return true;
    }
    local = dvec3(0.5);
    return newton(geometry, point, local);
  }

  dvec3 value(std::int32_t piece, const dvec3&, const dvec3& local) const override {
    const Block& block = block_with(piece);
    const ivec3 cell = block.cell_of(piece - block.first);
    return tricubic_ ? block.values.at(cell, local, nullptr)
                     : trilinear(block.corners(block.vectors, cell), local, nullptr);
  }

 private:
  // What Newton's method asks.
  struct Cell {
    const LatticeSpline* spline;
    ivec3 index;
    std::array<dvec3, 8> corners;

    dvec3 at(const dvec3& local, glm::dmat3& jacobian) const {
      return spline ? spline->at(index, local, &jacobian) : trilinear(corners, local, &jacobian);
    }
    double diameter() const {
      double longest = 0;
      for (std::size_t c = 1; c < 8; c++) longest = std::max(longest, glm::length(corners[c] - corners[0]));
      return longest;
    }
  };

  static Cell cell_at(const Block& block, const ivec3& cell, bool spline) {
    return {spline ? &block.places : nullptr, cell, block.corners(block.points, cell)};
  }

  // Splines of blocks that touch reach into each other's cells. A point belongs to the first block whose trilinear
  // cells contain it, if the spline of that block does so too; its cells are put first.
  void prefer_block_of_cells(const dvec3& point, std::vector<std::int32_t>& candidates) const {
    dvec3 local;
    const auto first =
        std::ranges::find_if(candidates, [&](std::int32_t number) { return holds(number, point, 0, false, local); });
    if (first == candidates.end()) return;
    const Block* preferred = &block_with(*first);
    std::ranges::stable_partition(candidates, [&](std::int32_t number) { return &block_with(number) == preferred; });
  }

  Block block_of(const CurvilinearBlock& given, std::int32_t first) const {
    Block block;
    block.size = given.size;
    block.first = first;
    block.points.assign(given.points.begin(), given.points.end());
    block.blanked = given.blanked;
    for (const glm::vec3& v : given.vectors) {
      block.finite.push_back(is_finite(dvec3(v)) ? 1 : 0);
      block.vectors.push_back(block.finite.back() != 0 ? dvec3(v) : dvec3(0.0));
    }
    if (!tricubic_) return block;
    for (int axis = 0; axis < 3; axis++) block.periodic[std::size_t(axis)] = closes(block, axis);
    block.places = LatticeSpline(block.size, block.points, block.periodic);
    block.values = LatticeSpline(block.size, block.vectors, block.periodic);
    return block;
  }

  static bool closes(const Block& block, int axis) {
    dvec3 low = block.points[0], high = low;
    for (const dvec3& p : block.points) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    const double near = seam * greatest(high - low);
    const int last = block.size[axis] - 1, a = (axis + 1) % 3, b = (axis + 2) % 3;
    if (last < 2) return false;
    ivec3 p(0);
    for (p[a] = 0; p[a] < block.size[a]; p[a]++) {
      for (p[b] = 0; p[b] < block.size[b]; p[b]++) {
        ivec3 q = p;
        q[axis] = last;
        if (greatest(block.points[block.node(q)] - block.points[block.node(p)]) > near) return false;
      }
    }
    return true;
  }

  // The shortest mean of the edges along an axis, but no needle's width.
  static double size_of(const Block& block, const ivec3& cell) {
    const std::array<dvec3, 8> corners = block.corners(block.points, cell);
    dvec3 sums(0.0);
    for (std::size_t c = 0; c < 8; c++)
      for (int axis = 0; axis < 3; axis++)
        if ((c >> axis & 1) == 0) sums[axis] += 0.25 * glm::length(corners[c | std::size_t(1) << axis] - corners[c]);
    return std::max(std::min({sums.x, sums.y, sums.z}), 1e-3 * greatest(sums));
  }

  const Block& block_with(std::int32_t piece) const {
    const auto after = std::ranges::upper_bound(blocks_, piece, {}, &Block::first);
    return *(after - 1);
  }

  static bool is_blanked(const Block& block, const ivec3& cell) {
    if (block.blanked.empty()) return false;
    for (int c = 0; c < 8; c++)
      if (block.blanked[block.node(cell + ivec3(c & 1, c >> 1 & 1, c >> 2))] != 0) return true;
    return false;
  }

  bool defined(const Block& block, const ivec3& cell) const {
    const int from = tricubic_ ? -1 : 0, to = tricubic_ ? 2 : 1;
    for (int k = from; k <= to; k++) {
      for (int j = from; j <= to; j++) {
        for (int i = from; i <= to; i++) {
          ivec3 p = cell + ivec3(i, j, k);
          for (int axis = 0; axis < 3; axis++) {
            const int nodes = block.size[axis];
            if (block.periodic[std::size_t(axis)]) p[axis] = (p[axis] + nodes - 1) % (nodes - 1);
            p[axis] = std::clamp(p[axis], 0, nodes - 1);
          }
          if (block.finite[block.node(p)] == 0) return false;
        }
      }
    }
    return true;
  }

  // Whether a cell, the trilinear one or that of the spline, contains the point, or comes as near to it as `slack`.
  bool holds(std::int32_t number, const dvec3& point, double slack, bool spline, dvec3& local) const {
    const Block& block = block_with(number);
    const Cell cell = cell_at(block, block.cell_of(number - block.first), spline);
    const dvec3 guess = tetrahedral(cell.corners, point);
    const auto accepts = [&](const dvec3& start) {
      local = start;
      if (newton(cell, point, local) && greatest(local - 0.5) <= 0.5 + in_cell) return true;
      if (slack == 0) return false;
      const dvec3 within = glm::clamp(local, dvec3(0.0), dvec3(1.0));
      glm::dmat3 jacobian;
      if (!(glm::length(cell.at(within, jacobian) - point) <= slack)) return false;
      local = within;
      return true;
    };
    const dvec3 start = greatest(guess - 0.5) < farthest ? guess : dvec3(0.5);
    if (accepts(start)) return true;
    // It has come to an end elsewhere, and the map has an inverse all over the cell: no other place will do.
    dvec3 end = start;
    if (newton(cell, point, end) && upright(cell)) return false;
    for (int c = 0; c < 8; c++)
      if (accepts(dvec3(0.25) + 0.5 * dvec3(c & 1, c >> 1 & 1, c >> 2))) return true;
    return false;
  }

  // Whether the Jacobian's determinant has one sign at 27 places and does not come near to 0.
  static bool upright(const Cell& cell) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (int i = 0; i < 27; i++) {
      glm::dmat3 jacobian;
      cell.at(0.5 * dvec3(i % 3, i / 3 % 3, i / 9), jacobian);
      const double volume = glm::determinant(jacobian);
      least = std::min(least, volume);
      most = std::max(most, volume);
    }
    return least > 0.05 * most || most < 0.05 * least;
  }

  // Coordinates by the tetrahedron about the diagonal that the point is deepest in.
  static dvec3 tetrahedral(const std::array<dvec3, 8>& corners, const dvec3& point) {
    static constexpr std::array<std::array<int, 2>, 6> paths{{{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}}};
    double deepest = -std::numeric_limits<double>::infinity();
    dvec3 best(0.5);
    for (const auto& [a, b] : paths) {
      const glm::dmat3 edges(corners[std::size_t(a)] - corners[0], corners[std::size_t(b)] - corners[0],
                             corners[7] - corners[0]);
      if (glm::determinant(edges) == 0) continue;
      const dvec3 weights = glm::inverse(edges) * (point - corners[0]);
      const double depth = std::min({weights.x, weights.y, weights.z, 1 - weights.x - weights.y - weights.z});
      if (!(depth > deepest)) continue;
      deepest = depth;
      const auto place = [](int c) { return dvec3(c & 1, c >> 1 & 1, c >> 2); };
      best = weights.x * place(a) + weights.y * place(b) + weights.z * place(7);
    }
    return best;
  }

  // True where the point is met to rounding.
  static bool newton(const Cell& cell, const dvec3& point, dvec3& local) {
    const double size = cell.diameter(), goal = 1e-15 * (size + greatest(point));
    glm::dmat3 jacobian;
    dvec3 rest = point - cell.at(local, jacobian);
    for (int i = 0; i < 60; i++) {
      const double distance = glm::length(rest);
      if (distance <= goal) return true;
      dvec3 step = glm::inverse(jacobian) * rest;
      if (!is_finite(step) || greatest(step) > 4) {
        // Levenberg's: towards the point, where the Jacobian has no inverse to speak of.
        const glm::dmat3 transposed = glm::transpose(jacobian);
        step = glm::inverse(transposed * jacobian + glm::dmat3(1e-4 * size * size)) * (transposed * rest);
      }
      double part = 1;
      glm::dmat3 next_jacobian;
      dvec3 next = local + step, next_rest = point - cell.at(next, next_jacobian);
      while (!(glm::length(next_rest) < distance) && part > 1e-3) {
        part *= 0.5;
        next = local + part * step;
        next_rest = point - cell.at(next, next_jacobian);
      }
      if (!(glm::length(next_rest) < distance)) break;  // rounding, or nothing is nearer
      local = next;
      rest = next_rest;
      jacobian = next_jacobian;
      if (greatest(local - 0.5) > 2 * farthest) return false;
    }
    return glm::length(rest) <= 64 * goal;
  }

  Bounds bounds_;
  bool tricubic_;
  std::vector<Block> blocks_;
  std::vector<double> sizes_;  // of cells
  BoxTree tree_;
};

}  // namespace

std::shared_ptr<const ReferenceFlow> refer_curvilinear_flow(const VectorFieldDefinition& definition) {
  return std::make_shared<CurvilinearReference>(dynamic_cast<const CurvilinearFlow&>(definition));
}

}  // namespace smurf
