#include "flows/grid/bends.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "flows/grid/vectors.hpp"
#include "numerics/parallel.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using glm::ivec3;

// Coefficients of the interpolating cubic B-spline with second derivative 0 at both ends, in a lattice that has one
// node more on each side. Vectors that do not count are 0, as on devices.
class Coefficients {
 public:
  explicit Coefficients(const VectorGrid& grid)
      : size_(grid.size + 2), values_(std::size_t(size_.x) * std::size_t(size_.y) * std::size_t(size_.z)) {
    for (int k = 0; k < grid.size.z; k++) {
      for (int j = 0; j < grid.size.y; j++) {
        for (int i = 0; i < grid.size.x; i++) {
          const glm::vec3& v =
              grid.vectors[std::size_t(i) +
                           std::size_t(grid.size.x) * (std::size_t(j) + std::size_t(grid.size.y) * std::size_t(k))];
          at({i, j, k}) = is_usable(v) ? dvec3(v) : dvec3(0.0);
        }
      }
    }
    for (int axis = 0; axis < 3; axis++) filter(axis, grid.size);
  }
  // From -1 on.
  const dvec3& at(const ivec3& node) const { return values_[place(node)]; }

 private:
  dvec3& at(const ivec3& node) { return values_[place(node)]; }
  std::size_t place(const ivec3& n) const {
    return std::size_t(n.x + 1) +
           std::size_t(size_.x) * (std::size_t(n.y + 1) + std::size_t(size_.y) * std::size_t(n.z + 1));
  }

  // c[i-1] + 4 c[i] + c[i+1] = 6 f[i], with c[-1] = 2 c[0] - c[1] and so at the other end, by elimination.
  void filter(int axis, const ivec3& size) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3, count = size[axis];
    // What earlier axes have put beyond the nodes is filtered, too.
    const int before_a = a < axis ? 1 : 0, before_b = b < axis ? 1 : 0;
    std::vector<double> above(std::size_t(count), 0.0);
    for (int i = 1; i + 1 < count; i++) above[std::size_t(i)] = 1 / (4 - above[std::size_t(i) - 1]);
    parallel_for(std::size_t(size[b]) + 2 * std::size_t(before_b), [&](std::size_t row) {
      for (int j = -before_a; j < size[a] + before_a; j++) {
        ivec3 n;
        n[a] = j;
        n[b] = int(row) - before_b;
        const auto node = [&](int i) -> dvec3& {
          n[axis] = i;
          return at(n);
        };
        // At the ends the coefficient is the value itself.
        for (int i = 1; i + 1 < count; i++) {
          const dvec3 rest = i == 1 ? node(0) : node(i - 1);
          const dvec3 sum = 6.0 * node(i) - rest - (i + 2 == count ? node(count - 1) : dvec3(0.0));
          node(i) = sum * above[std::size_t(i)];
        }
        for (int i = count - 3; i >= 1; i--) node(i) -= above[std::size_t(i)] * node(i + 1);
        const dvec3 first = 2.0 * node(0) - node(1), last = 2.0 * node(count - 1) - node(count - 2);
        node(-1) = first;
        node(count) = last;
      }
    });
  }

  ivec3 size_;
  std::vector<dvec3> values_;
};

constexpr std::array<std::array<int, 2>, 6> pairs{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

// The greatest magnitudes of a second difference among those that a cell's derivative is made of.
dvec3 greatest_difference(const Coefficients& c, const ivec3& cell, int a, int b) {
  ivec3 first = cell - 1, last = cell + 2, step_a(0), step_b(0);
  step_a[a] = 1;
  step_b[b] = 1;
  // Differences begin at these nodes: one, or along the same axis two, less than there are coefficients.
  last -= step_a + step_b;
  dvec3 greatest(0.0);
  for (int k = first.z; k <= last.z; k++) {
    for (int j = first.y; j <= last.y; j++) {
      for (int i = first.x; i <= last.x; i++) {
        const ivec3 n(i, j, k);
        const dvec3 d = (c.at(n + step_a + step_b) - c.at(n + step_a)) - (c.at(n + step_b) - c.at(n));
        greatest = glm::max(greatest, glm::abs(d));
      }
    }
  }
  return greatest;
}

}  // namespace

GridBends::GridBends(const VectorGrid& grid)
    : cells_(grid.size - 1), placement_(grid.placement), to_index_(glm::inverse(grid.placement.axes)) {
  const Coefficients coefficients(grid);
  greatest_.resize(std::size_t(cells_.x) * std::size_t(cells_.y) * std::size_t(cells_.z));
  glm::dmat3 scale;  // magnitudes: ∂index/∂space
  for (int column = 0; column < 3; column++) scale[column] = glm::abs(to_index_[column]);
  parallel_for(std::size_t(cells_.z), [&](std::size_t k) {
    for (int j = 0; j < cells_.y; j++) {
      for (int i = 0; i < cells_.x; i++) {
        std::array<std::array<dvec3, 3>, 3> by_index;
        for (const auto& [a, b] : pairs) {
          by_index[std::size_t(a)][std::size_t(b)] = by_index[std::size_t(b)][std::size_t(a)] =
              greatest_difference(coefficients, {i, j, int(k)}, a, b);
        }
        double squares = 0;
        for (int x = 0; x < 3; x++) {
          for (int y = 0; y < 3; y++) {
            dvec3 sum(0.0);
            for (int a = 0; a < 3; a++) {
              for (int b = 0; b < 3; b++) sum += scale[x][a] * scale[y][b] * by_index[std::size_t(a)][std::size_t(b)];
            }
            squares += glm::dot(sum, sum);
          }
        }
        const double bound = std::sqrt(squares) * (1 + 1e-9);
        greatest_[std::size_t(i) + std::size_t(cells_.x) * (std::size_t(j) + std::size_t(cells_.y) * k)] =
            std::nextafter(float(bound), std::numeric_limits<float>::infinity());
      }
    }
  });
}

double GridBends::within(const Bounds& box) const {
  dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
  for (int corner = 0; corner < 8; corner++) {
    const dvec3 p((corner & 1) ? box.upper.x : box.lower.x, (corner & 2) ? box.upper.y : box.lower.y,
                  (corner & 4) ? box.upper.z : box.lower.z);
    const dvec3 index = to_index_ * (p - placement_.origin);
    low = glm::min(low, index);
    high = glm::max(high, index);
  }
  constexpr double slack = 1e-6;  // for rounding, in cells
  ivec3 first, last;
  for (int axis = 0; axis < 3; axis++) {
    first[axis] = int(std::clamp(std::floor(low[axis] - slack), 0.0, double(cells_[axis] - 1)));
    last[axis] = int(std::clamp(std::floor(high[axis] + slack), 0.0, double(cells_[axis] - 1)));
  }
  float greatest = 0;
  for (int k = first.z; k <= last.z; k++) {
    for (int j = first.y; j <= last.y; j++) {
      const auto row = std::size_t(cells_.x) * (std::size_t(j) + std::size_t(cells_.y) * std::size_t(k));
      for (int i = first.x; i <= last.x; i++) greatest = std::max(greatest, greatest_[row + std::size_t(i)]);
    }
  }
  return greatest;
}

}  // namespace smurf
