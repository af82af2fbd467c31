#include "truth/flow/curvilinear.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>

namespace smurf::test {
namespace {

constexpr std::size_t slab_count = 64;
constexpr int kuhn_orders[6][3] = {{0, 1, 2}, {1, 0, 2}, {0, 2, 1}, {2, 0, 1}, {1, 2, 0}, {2, 1, 0}};

glm::dvec3 interpolated(const glm::dvec3 (&corners)[8], const glm::dvec3& l) {
  glm::dvec3 sum(0.0);
  for (int corner = 0; corner < 8; corner++) {
    double weight = 1;
    for (int axis = 0; axis < 3; axis++) weight *= (corner >> axis & 1) != 0 ? l[axis] : 1 - l[axis];
    sum += weight * corners[corner];
  }
  return sum;
}

// Columns: derivatives by the three local coordinates.
glm::dmat3 derivatives(const glm::dvec3 (&corners)[8], const glm::dvec3& l) {
  glm::dmat3 columns(0.0);
  for (int by = 0; by < 3; by++)
    for (int corner = 0; corner < 8; corner++) {
      double weight = (corner >> by & 1) != 0 ? 1 : -1;
      for (int axis = 0; axis < 3; axis++)
        if (axis != by) weight *= (corner >> axis & 1) != 0 ? l[axis] : 1 - l[axis];
      columns[by] += weight * corners[corner];
    }
  return columns;
}

// Sums of the sizes of each row: a matrix from space to local coordinates says how far these change.
glm::dvec3 reach_of(const glm::dmat3& to_local) {
  glm::dvec3 reach(0.0);
  for (int row = 0; row < 3; row++)
    for (int column = 0; column < 3; column++) reach[row] += std::abs(to_local[column][row]);
  return reach;
}

std::optional<glm::dvec3> newton(const glm::dvec3 (&corners)[8], const glm::dvec3& point, glm::dvec3 l, double scale) {
  for (int turn = 0; turn < 60; turn++) {
    const glm::dvec3 rest = point - interpolated(corners, l);
    const glm::dmat3 jacobian = derivatives(corners, l);
    if (glm::determinant(jacobian) == 0) return std::nullopt;
    const glm::dvec3 step = glm::inverse(jacobian) * rest;
    l = glm::clamp(l + step, -3.0, 4.0);
    if (glm::length(step) < 1e-13) break;
  }
  if (glm::length(point - interpolated(corners, l)) > 1e-11 * scale) return std::nullopt;
  return l;
}

// From the middle, and from the middles of eighths.
std::optional<glm::dvec3> inverted(const glm::dvec3 (&corners)[8], const glm::dvec3& point, double scale) {
  std::optional<glm::dvec3> best = newton(corners, point, glm::dvec3(0.5), scale);
  const auto outside = [](const glm::dvec3& l) {
    const glm::dvec3 off = glm::abs(l - 0.5);
    return std::max({off.x, off.y, off.z});
  };
  for (int start = 0; start < 8 && (!best || outside(*best) > 0.6); start++) {
    const glm::dvec3 from(0.25 + 0.5 * (start & 1), 0.25 + 0.5 * (start >> 1 & 1), 0.25 + 0.5 * (start >> 2));
    const std::optional<glm::dvec3> other = newton(corners, point, from, scale);
    if (other && (!best || outside(*other) < outside(*best))) best = other;
  }
  return best;
}

// In each of the six tetrahedra: those of an inverted cell overlap.
std::vector<CellTruth> by_tetrahedra(const glm::dvec3 (&corners)[8], const glm::dvec3 (&vectors)[8],
                                     const glm::dvec3& point) {
  std::vector<CellTruth> truths;
  for (const auto& order : kuhn_orders) {
    const int a = 1 << order[0], b = a | 1 << order[1];
    glm::dmat3 edges(0.0), slopes(0.0);
    edges[order[0]] = corners[a] - corners[0];
    edges[order[1]] = corners[b] - corners[a];
    edges[order[2]] = corners[7] - corners[b];
    slopes[order[0]] = vectors[a] - vectors[0];
    slopes[order[1]] = vectors[b] - vectors[a];
    slopes[order[2]] = vectors[7] - vectors[b];
    const double volume = glm::length(edges[0]) * glm::length(edges[1]) * glm::length(edges[2]);
    if (std::abs(glm::determinant(edges)) <= 1e-9 * volume) continue;
    const glm::dmat3 to_local = glm::inverse(edges);
    const glm::dvec3 l = to_local * (point - corners[0]);
    // Barycentric coordinates and how far each changes.
    const glm::dmat3 rows = glm::transpose(to_local);
    const auto size = [](const glm::dvec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
    const double depth = std::min(
        {(1 - l[order[0]]) / size(rows[order[0]]), (l[order[0]] - l[order[1]]) / size(rows[order[0]] - rows[order[1]]),
         (l[order[1]] - l[order[2]]) / size(rows[order[1]] - rows[order[2]]), l[order[2]] / size(rows[order[2]])});
    CellTruth truth;
    truth.depth = depth;
    truth.local = l;
    truth.reach = reach_of(to_local);
    truth.value = vectors[0] + slopes * l;
    truth.by_local = slopes;
    truths.push_back(truth);
  }
  return truths;
}

bool is_irregular(const glm::dvec3 (&corners)[8]) {
  int positive = 0, negative = 0;
  for (int corner = 0; corner < 8; corner++) {
    glm::dmat3 edges(0.0);
    double longest = 1;
    for (int axis = 0; axis < 3; axis++) {
      double along = 0;
      for (int from = 0; from < 8; from++)
        along = std::max(along, glm::length(corners[from | 1 << axis] - corners[from & ~(1 << axis)]));
      longest *= along;
      edges[axis] = corners[corner | 1 << axis] - corners[corner & ~(1 << axis)];
    }
    const double jacobian = glm::determinant(edges);
    positive += jacobian > 1e-6 * longest;
    negative += jacobian < -1e-6 * longest;
  }
  return positive < 8 && negative < 8;
}

std::vector<float> read_floats(std::ifstream& file, std::size_t count) {
  std::vector<std::uint32_t> words(count);
  file.read(reinterpret_cast<char*>(words.data()), std::streamsize(4 * count));
  std::vector<float> floats(count);
  for (std::size_t i = 0; i < count; i++) {
    const std::uint32_t w = words[i];
    floats[i] = std::bit_cast<float>(w >> 24 | (w >> 8 & 0xff00u) | (w << 8 & 0xff0000u) | w << 24);
  }
  return floats;
}

}  // namespace

CurvilinearBlock block_of(const glm::ivec3& size, const PlaceOf& place, const PlaceOf& field) {
  CurvilinearBlock block;
  block.size = size;
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++) {
        const glm::dvec3 at = place(glm::dvec3(i, j, k) / glm::dvec3(size - 1));
        block.points.push_back(at);
        block.vectors.push_back(glm::vec3(field(at)));
      }
  return block;
}

CurvilinearBlock read_plot3d_block(const std::filesystem::path& grid, const std::filesystem::path& solution) {
  std::ifstream places(grid, std::ios::binary), values(solution, std::ios::binary);
  CurvilinearBlock block;
  const std::vector<float> size = read_floats(places, 3);
  for (int axis = 0; axis < 3; axis++) block.size[axis] = std::bit_cast<int>(size[std::size_t(axis)]);
  const std::size_t nodes = std::size_t(block.size.x) * std::size_t(block.size.y) * std::size_t(block.size.z);
  const std::vector<float> points = read_floats(places, 3 * nodes);
  read_floats(values, 3 + 4);
  const std::vector<float> q = read_floats(values, 4 * nodes);
  if (!places || !values) throw std::runtime_error("a file of PLOT3D is too short: " + grid.string());
  for (std::size_t node = 0; node < nodes; node++) {
    block.points.push_back({points[node], points[nodes + node], points[2 * nodes + node]});
    const double density = q[node];
    block.vectors.push_back(glm::vec3(glm::dvec3(q[nodes + node], q[2 * nodes + node], q[3 * nodes + node]) / density));
  }
  return block;
}

CellTruths::CellTruths(std::vector<CurvilinearBlock> blocks)
    : slabs_(slab_count), lower_(std::numeric_limits<double>::infinity()), upper_(-lower_) {
  for (const CurvilinearBlock& block : blocks) {
    const std::size_t first = cells_.size();
    const glm::ivec3 size = block.size;
    for (int k = 0; k + 1 < size.z; k++)
      for (int j = 0; j + 1 < size.y; j++)
        for (int i = 0; i + 1 < size.x; i++) {
          Cell cell;
          cell.lower = glm::dvec3(std::numeric_limits<double>::infinity());
          cell.upper = -cell.lower;
          for (int corner = 0; corner < 8; corner++) {
            const int x = i + (corner & 1), y = j + (corner >> 1 & 1), z = k + (corner >> 2);
            const auto node = std::size_t(x + size.x * (y + size.y * z));
            cell.corners[corner] = block.points[node];
            cell.vectors[corner] = block.vectors[node];
            cell.lower = glm::min(cell.lower, cell.corners[corner]);
            cell.upper = glm::max(cell.upper, cell.corners[corner]);
          }
          cell.irregular = is_irregular(cell.corners);
          irregular_cells_ += cell.irregular;
          lower_ = glm::min(lower_, cell.lower);
          upper_ = glm::max(upper_, cell.upper);
          cells_.push_back(cell);
        }
    find_irregular(first, size - 1);
  }
  const glm::dvec3 half = 0.5 * (upper_ - lower_);
  size_ = std::max({half.x, half.y, half.z});
  const double width = (upper_.x - lower_.x) / double(slab_count);
  for (std::size_t cell = 0; cell < cells_.size(); cell++)
    for (std::size_t slab = 0; slab < slab_count; slab++) {
      const double from = lower_.x + width * double(slab);
      if (cells_[cell].upper.x >= from - 1e-3 * width && cells_[cell].lower.x <= from + 1.001 * width)
        slabs_[slab].push_back(std::uint32_t(cell));
    }
}

// Which cells share a face with an irregular one; the first and the last along an axis may do across a seam.
void CellTruths::find_irregular(std::size_t first, const glm::ivec3& size) {
  const auto at = [&](const glm::ivec3& c) -> Cell& {
    return cells_[first + std::size_t(c.x + size.x * (c.y + size.y * c.z))];
  };
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++)
        for (int axis = 0; axis < 3; axis++)
          for (const int step : {1, size[axis] - 1}) {
            glm::ivec3 other(i, j, k);
            other[axis] = (other[axis] + step) % size[axis];
            if (at(other).irregular) at({i, j, k}).beside = true;
          }
}

std::vector<CellTruth> CellTruths::about(const glm::dvec3& point, double tolerance) const {
  std::vector<CellTruth> found;
  const double place = (point.x - lower_.x) / (upper_.x - lower_.x) * double(slab_count);
  const auto slab = std::size_t(std::clamp(place, 0.0, double(slab_count - 1)));
  for (const std::uint32_t number : slabs_[slab]) {
    const Cell& cell = cells_[number];
    if (glm::any(glm::lessThan(point, cell.lower - tolerance)) ||
        glm::any(glm::greaterThan(point, cell.upper + tolerance)))
      continue;
    const auto keep = [&](CellTruth truth) {
      if (!(truth.depth >= -tolerance)) return;
      truth.cell = std::int64_t(number);
      found.push_back(truth);
    };
    if (cell.irregular || cell.beside) {
      for (CellTruth truth : by_tetrahedra(cell.corners, cell.vectors, point)) {
        truth.irregular = cell.irregular;
        truth.only_between = !cell.irregular;
        keep(truth);
      }
    }
    if (cell.irregular) continue;
    const std::optional<glm::dvec3> l = inverted(cell.corners, point, glm::length(cell.upper - cell.lower));
    if (!l) continue;
    CellTruth truth;
    truth.local = *l;
    truth.reach = reach_of(glm::inverse(derivatives(cell.corners, *l)));
    const glm::dvec3 inside = (0.5 - glm::abs(*l - 0.5)) / truth.reach;
    truth.depth = std::min({inside.x, inside.y, inside.z});
    truth.value = interpolated(cell.vectors, *l);
    truth.by_local = derivatives(cell.vectors, *l);
    keep(truth);
  }
  return found;
}

glm::dvec3 CellTruths::random_place(std::mt19937& random) const {
  std::uniform_real_distribution<double> unit(0, 1);
  const auto cell = std::min(cells_.size() - 1, std::size_t(unit(random) * double(cells_.size())));
  const double x = unit(random), y = unit(random), z = unit(random);
  return interpolated(cells_[cell].corners, {x, y, z});
}

}  // namespace smurf::test
