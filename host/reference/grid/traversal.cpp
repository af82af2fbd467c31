#include "reference/grid/traversal.hpp"

#include <algorithm>
#include <cmath>

namespace smurf {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double domain_slack = 1e-9;

// A ray in index coordinates with its parameter measured from where it enters the domain, so that far origins cost no
// precision in stepping: index = entry + direction·tau, t = t_entry + tau.
struct Traversal {
  glm::dvec3 entry, direction;
  double t_entry, length;
  glm::ivec3 cell, step;
  glm::dvec3 next;  // tau of the next plane along each axis
  glm::ivec3 cells;

  void find_next(int a) {
    const int beyond = cell[a] + step[a];
    if (step[a] == 0 || beyond < 0 || beyond >= cells[a]) {
      next[a] = infinity;  // no plane but the border of the domain
    } else {
      next[a] = (cell[a] + (step[a] > 0 ? 1 : 0) - entry[a]) / direction[a];
    }
  }
  // Crosses all planes up to tau.
  void advance(double tau) {
    for (int a = 0; a < 3; a++) {
      while (next[a] <= tau) {
        cell[a] += step[a];
        find_next(a);
      }
    }
  }
  double span_end() const { return std::min({next.x, next.y, next.z, length}); }
  // Where the ray leaves the block of cells that it is in.
  double block_end() const {
    double tau = length;
    for (int a = 0; a < 3; a++) {
      const int block = cell[a] / GridField::block_cells;
      const int plane = step[a] > 0 ? (block + 1) * GridField::block_cells : block * GridField::block_cells;
      if (step[a] != 0 && plane > 0 && plane < cells[a]) tau = std::min(tau, (plane - entry[a]) / direction[a]);
    }
    return tau;
  }
};

// False when the ray misses the domain.
bool enter(const GridField& field, const ReferenceRay& ray, Traversal& traversal) {
  const glm::dvec3 origin = field.to_index(ray.origin);
  traversal.direction = field.direction_to_index(ray.direction);
  traversal.cells = field.cells();
  double from = ray.t_min, to = ray.t_max;
  for (int a = 0; a < 3; a++) {
    const double low = -domain_slack, high = field.size()[a] - 1 + domain_slack;
    if (traversal.direction[a] == 0) {
      if (!(origin[a] >= low && origin[a] <= high)) return false;
      continue;
    }
    const double at_low = (low - origin[a]) / traversal.direction[a],
                 at_high = (high - origin[a]) / traversal.direction[a];
    from = std::max(from, std::min(at_low, at_high));
    to = std::min(to, std::max(at_low, at_high));
  }
  if (!(from <= to) || !std::isfinite(from) || !std::isfinite(to)) return false;
  traversal.t_entry = from;
  traversal.length = to - from;
  for (int a = 0; a < 3; a++) {
    traversal.entry[a] = std::fma(traversal.direction[a], from, origin[a]);
    traversal.step[a] = (traversal.direction[a] > 0) - (traversal.direction[a] < 0);
    const double inside = std::clamp(traversal.entry[a], 0.0, double(field.size()[a] - 1));
    traversal.cell[a] = std::min(int(inside), traversal.cells[a] - 1);
    traversal.find_next(a);
  }
  traversal.advance(0);
  return true;
}

RaySpan make_span(const GridField& field, const Traversal& traversal, double from, double to,
                  const GridField::Cell& cell) {
  RaySpan span{traversal.t_entry + 0.5 * (from + to), 0.5 * (to - from), {}, cell.scale, cell.rounding};
  static const ChebyshevPoints cubic(3), nonic(9);
  const int degree = field.degree();
  const ChebyshevPoints& points = degree == 3 ? cubic : nonic;
  double values[Chebyshev::max_degree + 1], coefficients[Chebyshev::max_degree + 1];
  const glm::dvec3 middle = traversal.entry + 0.5 * (from + to) * traversal.direction - glm::dvec3(traversal.cell);
  const glm::dvec3 half = 0.5 * (to - from) * traversal.direction;
  for (int j = 0; j <= degree; j++) values[j] = field.evaluate(cell, middle + points[j] * half);
  points.coefficients(values, coefficients);
  span.f = Chebyshev(degree, coefficients);
  return span;
}

// +1 or -1 when [lower, upper] is clear of 0 by `margin`; 0 otherwise.
int clear_sign(double lower, double upper, double margin) {
  if (lower > margin) return 1;
  if (upper < -margin) return -1;
  return 0;
}

}  // namespace

void traverse_ray(const GridField& field, double isovalue, const ReferenceRay& ray, RayVisitor& visitor) {
  Traversal traversal;
  if (!enter(field, ray, traversal)) return;
  visitor.gap(traversal.t_entry);
  GridField::Cell cell;
  double tau = 0;
  for (bool more = true; more && !visitor.finished();) {
    const double t = traversal.t_entry + tau;
    const GridField::Block& block = field.block(traversal.cell / GridField::block_cells);
    const double lower = block.lower - isovalue, upper = block.upper - isovalue;
    // As for a cell: the bounds' magnitude is no less than the scale of any cell of the block.
    const double scale = std::max(std::abs(lower), std::abs(upper));
    const double bound = std::max(visitor.clear_above() * scale, 1e-14 * (std::abs(isovalue) + scale));
    double end = traversal.span_end();
    if (const int sign = clear_sign(lower, upper, bound); sign != 0 && !block.mixed) {
      end = std::max(end, traversal.block_end());
      visitor.clear(sign, t);
    } else if (!field.defined(traversal.cell)) {
      visitor.gap(t);
      visitor.gap(traversal.t_entry + end);
    } else {
      field.load(traversal.cell, isovalue, cell);
      const int cell_sign =
          clear_sign(cell.lower, cell.upper, std::max(visitor.clear_above() * cell.scale, cell.rounding));
      if (cell_sign != 0) {
        visitor.clear(cell_sign, t);
      } else {
        visitor.span(make_span(field, traversal, tau, end, cell));
      }
    }
    more = end < traversal.length;
    tau = end;
    traversal.advance(tau);
  }
  if (!visitor.finished()) visitor.gap(traversal.t_entry + traversal.length);
}

}  // namespace smurf
