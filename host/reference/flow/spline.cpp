#include "reference/flow/spline.hpp"

#include <utility>

namespace smurf {
namespace {

using glm::dvec3;
using glm::ivec3;

// Coefficients 0 .. n-1 of a natural axis: the outer ones are the outer values.
void solve_natural(std::vector<dvec3>& f) {
  const std::size_t n = f.size();
  if (n < 3) return;
  // Thomas' algorithm for 1 4 1 on the inner nodes.
  std::vector<double> upper(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; i++) {
    const double pivot = 4 - upper[i - 1];
    upper[i] = 1 / pivot;
    const dvec3 next = i + 2 == n ? f[n - 1] : dvec3(0.0);
    f[i] = (6.0 * f[i] - next - f[i - 1]) / pivot;
  }
  // The first inner row had the known c[0] = f[0] subtracted, the last c[n-1].
  for (std::size_t i = n - 2; i-- > 1;) f[i] -= upper[i] * f[i + 1];
}

// Of n values on a circle, by the Sherman-Morrison formula.
void solve_cyclic(std::vector<dvec3>& f) {
  const std::size_t n = f.size();
  if (n == 1) return;
  if (n == 2) {
    // (4 a + 2 b) / 6 = f[0], (2 a + 4 b) / 6 = f[1]
    const dvec3 a = 2.0 * f[0] - f[1], b = 2.0 * f[1] - f[0];
    f[0] = a;
    f[1] = b;
    return;
  }
  // The corners are written as a product u wᵀ with u = (-4, 0, ..., 1), w = (1, 0, ..., -1/4).
  const auto diagonal = [n](std::size_t i) { return i == 0 ? 8.0 : i + 1 == n ? 4.25 : 4.0; };
  std::vector<double> upper(n), u(n, 0.0);
  u[0] = -4;
  u[n - 1] = 1;
  for (std::size_t i = 0; i < n; i++) {
    const double pivot = diagonal(i) - (i > 0 ? upper[i - 1] : 0);
    upper[i] = 1 / pivot;
    f[i] = (6.0 * f[i] - (i > 0 ? f[i - 1] : dvec3(0.0))) / pivot;
    u[i] = (u[i] - (i > 0 ? u[i - 1] : 0)) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 0;) {
    f[i] -= upper[i] * f[i + 1];
    u[i] -= upper[i] * u[i + 1];
  }
  const dvec3 part = (f[0] - 0.25 * f[n - 1]) / (1 + u[0] - 0.25 * u[n - 1]);
  for (std::size_t i = 0; i < n; i++) f[i] -= part * u[i];
}

// n values along an axis become n + 2 coefficients, -1 to n.
std::vector<dvec3> axis_coefficients(std::vector<dvec3> f, bool periodic) {
  const std::size_t n = f.size();
  std::vector<dvec3> result(n + 2);
  if (periodic) {
    f.pop_back();
    solve_cyclic(f);
    for (std::size_t i = 0; i < n + 2; i++) result[i] = f[(i + 2 * (n - 1) - 1) % (n - 1)];
    return result;
  }
  solve_natural(f);
  for (std::size_t i = 0; i < n; i++) result[i + 1] = f[i];
  result[0] = 2.0 * result[1] - result[2];
  result[n + 1] = 2.0 * result[n] - result[n - 1];
  return result;
}

struct Basis {
  std::array<double, 4> value, slope;
};

Basis basis(double t) {
  const double s = 1 - t;
  return {{s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6},
          {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2}};
}

}  // namespace

LatticeSpline::LatticeSpline(const ivec3& size, std::vector<dvec3> nodes, const std::array<bool, 3>& periodic) {
  // Axis by axis: the axis at hand becomes two longer.
  ivec3 now = size;
  std::vector<dvec3> values = std::move(nodes);
  for (int axis = 0; axis < 3; axis++) {
    ivec3 next = now;
    next[axis] += 2;
    std::vector<dvec3> grown(std::size_t(next.x) * std::size_t(next.y) * std::size_t(next.z));
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const auto index = [](const ivec3& extent, const ivec3& p) {
      return (std::size_t(p.z) * std::size_t(extent.y) + std::size_t(p.y)) * std::size_t(extent.x) + std::size_t(p.x);
    };
    for (int u = 0; u < now[a]; u++) {
      for (int v = 0; v < now[b]; v++) {
        ivec3 p(0);
        p[a] = u;
        p[b] = v;
        std::vector<dvec3> line(std::size_t(now[axis]));
        for (p[axis] = 0; p[axis] < now[axis]; p[axis]++) line[std::size_t(p[axis])] = values[index(now, p)];
        const std::vector<dvec3> solved = axis_coefficients(std::move(line), periodic[std::size_t(axis)]);
        for (p[axis] = 0; p[axis] < next[axis]; p[axis]++) grown[index(next, p)] = solved[std::size_t(p[axis])];
      }
    }
    values = std::move(grown);
    now = next;
  }
  padded_ = now;
  coefficients_ = std::move(values);
}

dvec3 LatticeSpline::at(const ivec3& cell, const dvec3& local, glm::dmat3* jacobian) const {
  const Basis x = basis(local.x), y = basis(local.y), z = basis(local.z);
  dvec3 value(0.0);
  glm::dmat3 slopes(0.0);
  for (int k = 0; k < 4; k++) {
    for (int j = 0; j < 4; j++) {
      dvec3 row(0.0), row_slope(0.0);
      for (int i = 0; i < 4; i++) {
        const dvec3& c = coefficient(cell.x + i, cell.y + j, cell.z + k);
        row += x.value[std::size_t(i)] * c;
        row_slope += x.slope[std::size_t(i)] * c;
      }
      const auto jj = std::size_t(j), kk = std::size_t(k);
      value += y.value[jj] * z.value[kk] * row;
      slopes[0] += y.value[jj] * z.value[kk] * row_slope;
      slopes[1] += y.slope[jj] * z.value[kk] * row;
      slopes[2] += y.value[jj] * z.slope[kk] * row;
    }
  }
  if (jacobian) *jacobian = slopes;
  return value;
}

void LatticeSpline::box(const ivec3& cell, dvec3& lower, dvec3& upper) const {
  lower = upper = coefficient(cell.x, cell.y, cell.z);
  for (int k = 0; k < 4; k++) {
    for (int j = 0; j < 4; j++) {
      for (int i = 0; i < 4; i++) {
        const dvec3& c = coefficient(cell.x + i, cell.y + j, cell.z + k);
        lower = glm::min(lower, c);
        upper = glm::max(upper, c);
      }
    }
  }
}

dvec3 trilinear(const std::array<dvec3, 8>& corners, const dvec3& local, glm::dmat3* jacobian) {
  dvec3 value(0.0);
  glm::dmat3 slopes(0.0);
  for (std::size_t c = 0; c < 8; c++) {
    const dvec3 weight((c & 1) != 0 ? local.x : 1 - local.x, (c & 2) != 0 ? local.y : 1 - local.y,
                       (c & 4) != 0 ? local.z : 1 - local.z);
    const dvec3 sign((c & 1) != 0 ? 1 : -1, (c & 2) != 0 ? 1 : -1, (c & 4) != 0 ? 1 : -1);
    value += weight.x * weight.y * weight.z * corners[c];
    slopes[0] += sign.x * weight.y * weight.z * corners[c];
    slopes[1] += weight.x * sign.y * weight.z * corners[c];
    slopes[2] += weight.x * weight.y * sign.z * corners[c];
  }
  if (jacobian) *jacobian = slopes;
  return value;
}

}  // namespace smurf
