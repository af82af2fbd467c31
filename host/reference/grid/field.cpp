#include "reference/grid/field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

double rounded_to_float(double v) {
  if (std::abs(v) > std::numeric_limits<float>::max()) return std::copysign(std::numeric_limits<double>::infinity(), v);
  return double(float(v));
}

// Index of the whole-sample symmetric continuation.
int mirrored(int i, int n) {
  if (i >= 0 && i < n) return i;
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  i = ((i % period) + period) % period;
  return i < n ? i : period - i;
}

using Weights = std::array<std::array<double, 4>, 3>;  // by order of the derivative, for taps -1, 0, 1, 2

Weights difference_weights(double u) {
  const double v = 1 - u;
  return {{{0, v, u, 0}, {-v / 2, -u / 2, v / 2, u / 2}, {v, u - 2 * v, v - 2 * u, u}}};
}

Weights spline_weights(double u) {
  const double v = 1 - u;
  return {{{v * v * v / 6, (4 - 6 * u * u + 3 * u * u * u) / 6, (4 - 6 * v * v + 3 * v * v * v) / 6, u * u * u / 6},
           {-v * v / 2, (3 * u - 4) * u / 2, (4 - 3 * v) * v / 2, u * u / 2},
           {v, 3 * u - 2, 3 * v - 2, u}}};
}

Weights convolution_weights(double u) {
  return {
      {{((2 - u) * u - 1) * u / 2, ((3 * u - 5) * u * u + 2) / 2, ((4 - 3 * u) * u + 1) * u / 2, (u - 1) * u * u / 2},
       {((4 - 3 * u) * u - 1) / 2, (9 * u - 10) * u / 2, ((8 - 9 * u) * u + 1) / 2, (3 * u - 2) * u / 2},
       {2 - 3 * u, 9 * u - 5, 4 - 9 * u, 3 * u - 1}}};
}

Weights weights_of(Reconstruction reconstruction, double u) {
  switch (reconstruction) {
    case Reconstruction::trilinear:
      return difference_weights(u);
    case Reconstruction::tricubic:
      return spline_weights(u);
    case Reconstruction::catmull_rom:
      break;
  }
  return convolution_weights(u);
}

// Solves (c[i-1] + 4 c[i] + c[i+1])/6 = f[i], mirrored at both ends, for `width` adjacent lines at once
// (Thomas). The matrix dominates its diagonal, so elimination without pivots is stable.
void solve_lines(double* f, int n, std::size_t stride, std::size_t width) {
  if (n == 1) return;
  std::vector<double> upper(n);
  upper[0] = 0.5;
  for (std::size_t x = 0; x < width; x++) f[x] *= 1.5;
  for (int i = 1; i < n; i++) {
    const double below = i == n - 1 ? 2 : 1;
    const double pivot = 4 - below * upper[i - 1];
    upper[i] = 1 / pivot;
    double* row = f + i * stride;
    for (std::size_t x = 0; x < width; x++) row[x] = (6 * row[x] - below * row[x - std::ptrdiff_t(stride)]) / pivot;
  }
  for (int i = n - 2; i >= 0; i--) {
    double* row = f + i * stride;
    for (std::size_t x = 0; x < width; x++) row[x] -= upper[i] * row[x + stride];
  }
}

template <int width>
double tensor_sum(const double* taps, const double* wx, const double* wy, const double* wz) {
  double sum = 0;
  for (int k = 0; k < width; k++) {
    double plane = 0;
    for (int j = 0; j < width; j++) {
      double row = 0;
      for (int i = 0; i < width; i++) row += wx[i] * *taps++;
      plane += wy[j] * row;
    }
    sum += wz[k] * plane;
  }
  return sum;
}

}  // namespace

GridField::GridField(const Volume& volume, Reconstruction reconstruction)
    : size_(volume.size()),
      cells_(glm::max(size_ - 1, glm::ivec3(1))),
      axes_(volume.placement().axes),
      to_index_(glm::inverse(axes_)),
      origin_(volume.placement().origin),
      reconstruction_(reconstruction),
      width_(reconstruction == Reconstruction::trilinear ? 2 : 4) {
  try {
    read_samples(volume);
    if (reconstruction == Reconstruction::tricubic) solve_coefficients();
    bound_blocks();
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::memory, "the reference needs " + std::to_string(volume.count() * sizeof(double)) +
                                       " bytes of memory for the samples as doubles, and more for bounds");
  }
}

void GridField::read_samples(const Volume& volume) {
  values_.resize(volume.count());
  std::vector<std::size_t> not_finite;
  for (std::size_t i = 0; i < values_.size(); i++) {
    values_[i] = rounded_to_float(volume.at(i));
    if (std::isfinite(values_[i])) continue;
    not_finite.push_back(i);
    if (reconstruction_ == Reconstruction::tricubic) values_[i] = 0;
  }
  if (!not_finite.empty()) mark_undefined(not_finite);
}

// Cell c is made from samples c .. c+1, or c-1 .. c+2; the continuation beyond the border uses no others.
void GridField::mark_undefined(const std::vector<std::size_t>& not_finite) {
  undefined_.assign(std::size_t(cells_.x) * cells_.y * cells_.z, 0);
  auto mark = [&](const glm::ivec3& first, const glm::ivec3& last, std::uint8_t bit) {
    const glm::ivec3 a = glm::max(first, glm::ivec3(0)), b = glm::min(last, cells_ - 1);
    for (int k = a.z; k <= b.z; k++) {
      for (int j = a.y; j <= b.y; j++) {
        for (int i = a.x; i <= b.x; i++) undefined_[cell_index({i, j, k})] |= bit;
      }
    }
  };
  for (const std::size_t i : not_finite) {
    const glm::ivec3 s(int(i % size_.x), int(i / size_.x % size_.y), int(i / size_.x / size_.y));
    mark(s - 2, s + 1, no_derivative);
    if (width_ == 2) {
      mark(s - 1, s, no_value);
    } else {
      mark(s - 2, s + 1, no_value);
    }
  }
}

void GridField::solve_coefficients() {
  const std::size_t row = size_.x, plane = row * size_.y;
  parallel_for(size_.z, [&](std::size_t k) {
    double* slice = values_.data() + k * plane;
    for (int j = 0; j < size_.y; j++) solve_lines(slice + j * row, size_.x, 1, 1);
    solve_lines(slice, size_.y, row, row);
  });
  parallel_for(size_.y, [&](std::size_t j) { solve_lines(values_.data() + j * row, size_.z, plane, row); });
}

// From bounds of the taps to bounds of the field. Weights of trilinear and B-spline are positive and sum to 1; the
// absolute weights of Catmull-Rom sum to at most 5/4 along each axis, at the middle of a cell.
void GridField::widen(double& lower, double& upper) const {
  if (reconstruction_ != Reconstruction::catmull_rom) return;
  const double middle = 0.5 * (lower + upper), half = 1.25 * 1.25 * 1.25 * (upper - middle);
  lower = middle - half;
  upper = middle + half;
}

GridField::Block GridField::bound_block(const glm::ivec3& block) const {
  const int before = width_ == 2 ? 0 : 1;
  const glm::ivec3 first = block * block_cells, end = glm::min(first + block_cells, cells_);
  const glm::ivec3 a = glm::max(first - before, glm::ivec3(0)), b = glm::min(end + before, size_ - 1);
  Block out{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), false};
  for (int k = a.z; k <= b.z; k++) {
    for (int j = a.y; j <= b.y; j++) {
      for (int i = a.x; i <= b.x; i++) {
        const double v = values_[sample_index(i, j, k)];
        if (!std::isfinite(v)) continue;
        out.lower = std::min(out.lower, v);
        out.upper = std::max(out.upper, v);
      }
    }
  }
  widen(out.lower, out.upper);
  for (int k = first.z; k < end.z && !undefined_.empty(); k++) {
    for (int j = first.y; j < end.y; j++) {
      for (int i = first.x; i < end.x; i++) out.mixed |= !defined({i, j, k});
    }
  }
  return out;
}

void GridField::bound_blocks() {
  blocks_size_ = (cells_ + (block_cells - 1)) / block_cells;
  blocks_.resize(std::size_t(blocks_size_.x) * blocks_size_.y * blocks_size_.z);
  parallel_for(blocks_size_.z, [&](std::size_t k) {
    std::size_t at = k * blocks_size_.y * blocks_size_.x;
    for (int j = 0; j < blocks_size_.y; j++) {
      for (int i = 0; i < blocks_size_.x; i++) blocks_[at++] = bound_block({i, j, int(k)});
    }
  });
}

double GridField::shortest_step() const {
  return std::min({glm::length(axes_[0]), glm::length(axes_[1]), glm::length(axes_[2])});
}

std::size_t GridField::bytes() const {
  return values_.size() * sizeof(double) + undefined_.size() + blocks_.size() * sizeof(Block);
}

// Bounds are kept per column of taps, so that compilers turn the inner loop into vector instructions.
template <int width>
void GridField::load_taps(const glm::ivec3& cell, double offset, Cell& out) const {
  const glm::ivec3 first = cell - (width - 2) / 2;
  const bool inside = first.x >= 0 && first.x + width <= size_.x;
  double lower[width], upper[width];
  std::fill_n(lower, width, std::numeric_limits<double>::infinity());
  std::fill_n(upper, width, -std::numeric_limits<double>::infinity());
  double* tap = out.taps.data();
  for (int k = 0; k < width; k++) {
    for (int j = 0; j < width; j++, tap += width) {
      const double* row =
          values_.data() + sample_index(0, mirrored(first.y + j, size_.y), mirrored(first.z + k, size_.z));
      for (int i = 0; i < width; i++) tap[i] = row[inside ? first.x + i : mirrored(first.x + i, size_.x)] - offset;
      for (int i = 0; i < width; i++) {
        lower[i] = std::min(lower[i], tap[i]);
        upper[i] = std::max(upper[i], tap[i]);
      }
    }
  }
  out.lower = *std::min_element(lower, lower + width);
  out.upper = *std::max_element(upper, upper + width);
}

void GridField::load(const glm::ivec3& cell, double offset, Cell& out) const {
  if (width_ == 2) {
    load_taps<2>(cell, offset, out);
  } else {
    load_taps<4>(cell, offset, out);
  }
  out.scale = std::max(std::abs(out.lower), std::abs(out.upper));
  out.rounding = 8 * std::numeric_limits<double>::epsilon() * (std::abs(offset) + out.scale);
  widen(out.lower, out.upper);
}

double GridField::evaluate(const Cell& cell, const glm::dvec3& local) const {
  if (width_ == 2) {
    const double x[2] = {1 - local.x, local.x}, y[2] = {1 - local.y, local.y}, z[2] = {1 - local.z, local.z};
    return tensor_sum<2>(cell.taps.data(), x, y, z);
  }
  const bool spline = reconstruction_ == Reconstruction::tricubic;
  std::array<double, 4> weight[3];
  for (int a = 0; a < 3; a++) weight[a] = spline ? spline_weights(local[a])[0] : convolution_weights(local[a])[0];
  return tensor_sum<4>(cell.taps.data(), weight[0].data(), weight[1].data(), weight[2].data());
}

bool GridField::locate(const glm::dvec3& point, glm::ivec3& cell, glm::dvec3& local) const {
  const glm::dvec3 x = to_index(point);
  for (int a = 0; a < 3; a++) {
    double rounding = 0;
    for (int b = 0; b < 3; b++) rounding += std::abs(to_index_[b][a]) * std::abs(point[b]);
    const double tolerance = 1e-6 + std::numeric_limits<float>::epsilon() * rounding;
    const double last = size_[a] - 1;
    if (!(x[a] >= -tolerance && x[a] <= last + tolerance)) return false;
    const double inside = std::clamp(x[a], 0.0, last);
    cell[a] = std::min(int(inside), cells_[a] - 1);
    local[a] = inside - cell[a];
  }
  return true;
}

GridField::AxisWeights GridField::axis_weights(int axis, int cell, double u) const {
  const int n = size_[axis];
  AxisWeights out{{}, weights_of(reconstruction_, u)};
  for (int i = 0; i < 4; i++) out.index[i] = mirrored(cell - 1 + i, n);
  if (reconstruction_ != Reconstruction::trilinear) return out;
  for (auto& w : out.weight) {  // beyond the border: twice the outer sample less its neighbour
    if (cell - 1 < 0) {
      w[1] += 2 * w[0];
      w[2] -= w[0];
      w[0] = 0;
    }
    if (cell + 2 >= n) {
      w[2] += 2 * w[3];
      w[1] -= w[3];
      w[3] = 0;
    }
  }
  return out;
}

std::optional<double> GridField::value(const glm::dvec3& point) const {
  glm::ivec3 cell;
  glm::dvec3 local;
  if (!locate(point, cell, local) || !defined(cell)) return {};
  Cell taps;
  load(cell, 0, taps);
  return evaluate(taps, local);
}

std::optional<Jet> GridField::jet(const glm::dvec3& point) const {
  glm::ivec3 cell;
  glm::dvec3 local;
  if (!locate(point, cell, local)) return {};
  if (!undefined_.empty() && undefined_[cell_index(cell)] & no_derivative) return {};
  std::array<AxisWeights, 3> axis;
  for (int a = 0; a < 3; a++) axis[a] = axis_weights(a, cell[a], local[a]);

  double sum[3][3][3] = {};  // by orders of the derivative along x, y, z; total order up to 2
  for (int k = 0; k < 4; k++) {
    for (int j = 0; j < 4; j++) {
      for (int i = 0; i < 4; i++) {
        const double v = values_[sample_index(axis[0].index[i], axis[1].index[j], axis[2].index[k])];
        for (int r = 0; r < 3; r++) {
          for (int q = 0; q + r < 3; q++) {
            const double w = v * axis[1].weight[q][j] * axis[2].weight[r][k];
            for (int p = 0; p + q + r < 3; p++) sum[p][q][r] += w * axis[0].weight[p][i];
          }
        }
      }
    }
  }
  const glm::dvec3 gradient(sum[1][0][0], sum[0][1][0], sum[0][0][1]);
  const glm::dmat3 hessian(sum[2][0][0], sum[1][1][0], sum[1][0][1],  //
                           sum[1][1][0], sum[0][2][0], sum[0][1][1],  //
                           sum[1][0][1], sum[0][1][1], sum[0][0][2]);
  const glm::dmat3 transposed = glm::transpose(to_index_);
  return Jet{sum[0][0][0], transposed * gradient, transposed * hessian * to_index_};
}

}  // namespace smurf
