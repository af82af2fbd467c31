#include "fields/voxel_tables.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "kernels/flow/curvilinear_layout.inc"

namespace smurf {
namespace {

constexpr std::uint32_t divided = 0xffffffffu;
// Voxels with more cells are divided. Voxels as large as cells meet 8 of them.
constexpr std::size_t many_cells = 24;
// A division that leaves more than this part of the cells in its voxels is none: where many cells overlap, voxels would
// be divided without end.
constexpr double too_little_gained = 0.25;
constexpr std::size_t most_voxels = 16;  // for each cell, all tables together, before nothing is divided any more
constexpr int most_along_axis = 1024;
// Devices number voxels in floats, which for 1024 along an axis are right to 1e-4.
constexpr double rounding_of_voxels = 1e-3;

struct Table {
  glm::vec3 lower, counts;  // counts: voxels per unit
  glm::ivec3 size;
};

struct VoxelRange {
  glm::ivec3 first, last;
};

class Builder {
 public:
  Builder(std::span<const CellBox> boxes, float slack, VoxelTables& tables)
      : boxes_(boxes), slack_(slack), tables_(tables) {}

  // Appends a table over a region, whose cells are listed, and those within it.
  void build(const glm::vec3& lower, const glm::vec3& upper, std::span<const std::uint32_t> cells, int depth) {
    Table table = table_over(lower, upper, cells.size());
    std::vector<std::uint32_t> begins = count(table, cells);
    // Cells that reach far through fine voxels would be listed too often.
    while (begins.back() > 16 * cells.size() + 4096) {
      const Table coarser = table_over(lower, upper, node_count(table) / 4);
      if (node_count(coarser) >= node_count(table)) break;
      table = coarser;
      begins = count(table, cells);
    }
    fill(append(table), table, begins, list(table, begins, cells), depth);
  }

 private:
  static std::size_t node_count(const Table& table) {
    return std::size_t(table.size.x) * std::size_t(table.size.y) * std::size_t(table.size.z);
  }

  // Voxels about as many as wanted, as near to cubes as the region allows.
  Table table_over(const glm::vec3& lower, const glm::vec3& upper, std::size_t wanted) const {
    const glm::dvec3 extent = glm::max(glm::dvec3(upper) - glm::dvec3(lower), glm::dvec3(16.0 * double(slack_)));
    double side = std::cbrt(extent.x * extent.y * extent.z / double(std::max<std::size_t>(wanted, 1)));
    Table table{lower, {}, {}};
    // Along an axis that is shorter than a voxel there is one all the same: where there are too many, larger ones do.
    for (bool too_many = true; too_many; side *= 1.25) {
      for (int axis = 0; axis < 3; axis++) {
        // Voxels much smaller than the slack would only repeat each other.
        const double most = std::min(double(most_along_axis), extent[axis] / (16.0 * double(slack_)));
        table.size[axis] = std::max(1, int(std::min(most, std::round(extent[axis] / side))));
        table.counts[axis] = float(double(table.size[axis]) / extent[axis]);
      }
      too_many = node_count(table) > 2 * wanted + 8;
    }
    return table;
  }

  VoxelRange voxels_of(const Table& table, const CellBox& box) const {
    VoxelRange range{};
    for (int axis = 0; axis < 3; axis++) {
      const auto voxel = [&](double at) {
        const double place = std::floor((at - double(table.lower[axis])) * double(table.counts[axis]));
        return int(std::clamp(place, 0.0, double(table.size[axis] - 1)));
      };
      const double more = double(slack_) + rounding_of_voxels / double(table.counts[axis]);
      range.first[axis] = voxel(double(box.lower[axis]) - more);
      range.last[axis] = voxel(double(box.upper[axis]) + more);
    }
    return range;
  }

  template <class Action>
  void for_voxels(const Table& table, std::span<const std::uint32_t> cells, const Action& action) const {
    for (const std::uint32_t cell : cells) {
      const VoxelRange range = voxels_of(table, boxes_[cell]);
      for (int z = range.first.z; z <= range.last.z; z++)
        for (int y = range.first.y; y <= range.last.y; y++)
          for (int x = range.first.x; x <= range.last.x; x++)
            action(std::size_t(x) +
                       std::size_t(table.size.x) * (std::size_t(y) + std::size_t(table.size.y) * std::size_t(z)),
                   cell);
    }
  }

  // Where the cells of each voxel begin in a common list; one number more for its end.
  std::vector<std::uint32_t> count(const Table& table, std::span<const std::uint32_t> cells) const {
    std::vector<std::uint32_t> begins(node_count(table) + 1);
    for_voxels(table, cells, [&](std::size_t voxel, std::uint32_t) { begins[voxel + 1]++; });
    std::partial_sum(begins.begin(), begins.end(), begins.begin());
    return begins;
  }

  std::vector<std::uint32_t> list(const Table& table, const std::vector<std::uint32_t>& begins,
                                  std::span<const std::uint32_t> cells) const {
    std::vector<std::uint32_t> listed(begins.back()), next(begins.begin(), begins.end() - 1);
    for_voxels(table, cells, [&](std::size_t voxel, std::uint32_t cell) { listed[next[voxel]++] = cell; });
    return listed;
  }

  // Returns where its voxels begin.
  std::size_t append(const Table& table) {
    const std::size_t first = tables_.voxels.size() / CURVILINEAR_VOXEL_WORDS;
    const auto word = [](float value) { return std::bit_cast<std::uint32_t>(value); };
    tables_.tables.insert(tables_.tables.end(),
                          {word(table.lower.x), word(table.lower.y), word(table.lower.z), 0, word(table.counts.x),
                           word(table.counts.y), word(table.counts.z), 0, std::uint32_t(table.size.x),
                           std::uint32_t(table.size.y), std::uint32_t(table.size.z), std::uint32_t(first)});
    tables_.voxels.resize(tables_.voxels.size() + CURVILINEAR_VOXEL_WORDS * node_count(table));
    return first;
  }

  bool has_room() const { return tables_.voxels.size() / CURVILINEAR_VOXEL_WORDS < most_voxels * boxes_.size(); }

  bool worth_dividing(const glm::vec3& lower, const glm::vec3& upper, std::span<const std::uint32_t> cells) const {
    const Table table = table_over(lower, upper, cells.size());
    const double left = double(count(table, cells).back()) / double(node_count(table));
    return left < too_little_gained * double(cells.size());
  }

  void fill(std::size_t first, const Table& table, const std::vector<std::uint32_t>& begins,
            const std::vector<std::uint32_t>& listed, int depth) {
    for (std::size_t voxel = 0; voxel + 1 < begins.size(); voxel++) {
      const std::span<const std::uint32_t> cells(listed.data() + begins[voxel], begins[voxel + 1] - begins[voxel]);
      const auto width = std::size_t(table.size.x), height = std::size_t(table.size.y);
      const std::size_t row = voxel / width, slice = row / height;
      const glm::dvec3 at(double(voxel % width), double(row % height), double(slice));
      const glm::vec3 lower(glm::dvec3(table.lower) + at / glm::dvec3(table.counts));
      const glm::vec3 upper(glm::dvec3(table.lower) + (at + 1.0) / glm::dvec3(table.counts));
      const std::size_t words = CURVILINEAR_VOXEL_WORDS * (first + voxel);
      if (cells.size() > many_cells && depth + 1 < CURVILINEAR_DEPTH && has_room() &&
          worth_dividing(lower, upper, cells)) {
        tables_.voxels[words] = std::uint32_t(tables_.tables.size() / CURVILINEAR_TABLE_WORDS);
        tables_.voxels[words + 1] = divided;
        build(lower, upper, cells, depth + 1);
        continue;
      }
      tables_.voxels[words] = std::uint32_t(tables_.cells.size());
      tables_.voxels[words + 1] = std::uint32_t(cells.size());
      tables_.cells.insert(tables_.cells.end(), cells.begin(), cells.end());
    }
  }

  std::span<const CellBox> boxes_;
  const float slack_;
  VoxelTables& tables_;
};

}  // namespace

VoxelTables build_voxel_tables(std::span<const CellBox> boxes, float slack) {
  VoxelTables tables;
  tables.lower = boxes.front().lower;
  tables.upper = boxes.front().upper;
  for (const CellBox& box : boxes) {
    tables.lower = glm::min(tables.lower, box.lower);
    tables.upper = glm::max(tables.upper, box.upper);
  }
  tables.lower -= slack;
  tables.upper += slack;
  std::vector<std::uint32_t> cells(boxes.size());
  std::iota(cells.begin(), cells.end(), 0u);
  Builder(boxes, slack, tables).build(tables.lower, tables.upper, cells, 0);
  return tables;
}

std::span<const std::uint32_t> cells_about(const VoxelTables& tables, const glm::vec3& point) {
  if (!glm::all(glm::greaterThanEqual(point, tables.lower)) || !glm::all(glm::lessThanEqual(point, tables.upper)))
    return {};
  for (std::size_t table = 0;;) {
    const std::uint32_t* words = tables.tables.data() + CURVILINEAR_TABLE_WORDS * table;
    std::size_t voxel = 0;
    for (std::size_t axis = 3; axis-- > 0;) {
      const float place =
          (point[int(axis)] - std::bit_cast<float>(words[axis])) * std::bit_cast<float>(words[4 + axis]);
      voxel = voxel * words[8 + axis] + std::min(std::size_t(std::max(place, 0.0f)), std::size_t(words[8 + axis]) - 1);
    }
    const std::uint32_t* entry = tables.voxels.data() + CURVILINEAR_VOXEL_WORDS * (words[11] + voxel);
    if (entry[1] != divided) return std::span(tables.cells).subspan(entry[0], entry[1]);
    table = entry[0];
  }
}

}  // namespace smurf
