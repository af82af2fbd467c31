#include "surfaces/directed_distances.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <vector>

#include "parallel.hpp"

namespace smurf {
namespace {

using std::size_t;
using std::uint8_t;

constexpr size_t cells_in_block = 4;
constexpr uint8_t farthest = 250;

// Cells by slices across one axis: where cell (s, b, c) stands among those of the tables, for s along the axis and b, c across.
struct Slices {
  std::array<size_t, 3> size;  // in cells: of s, b and c
  std::array<int, 3> axis;     // x, y or z of s, b and c
  glm::ivec3 blocks;

  size_t plane() const { return size[1] * size[2]; }
  // Of cells along one axis, relative to the first.
  size_t byte_of(int of, size_t cell) const {
    const size_t block = cell / cells_in_block, rest = cell % cells_in_block;
    constexpr size_t bytes = cells_in_block * cells_in_block * cells_in_block;
    const auto x = size_t(blocks.x), y = size_t(blocks.y);
    return of == 0   ? bytes * block + rest
           : of == 1 ? bytes * x * block + cells_in_block * rest
                     : bytes * x * y * block + cells_in_block * cells_in_block * rest;
  }
};

Slices slices_across(int axis, glm::ivec3 blocks) {
  // Rows along x, where there are, stand in memory as they do in the tables.
  const std::array<int, 3> axes = axis == 0   ? std::array{0, 2, 1}
                                  : axis == 1 ? std::array{1, 2, 0}
                                              : std::array{2, 1, 0};
  std::array<size_t, 3> size{};
  for (size_t i = 0; i < 3; i++) size[i] = cells_in_block * size_t(blocks[axes[i]]);
  return {size, axes, blocks};
}

// to[b][c] is the least of the 3 × 3 numbers around from[b][c].
void spread(const uint8_t* from, uint8_t* along, uint8_t* to, size_t rows, size_t columns) {
  for (size_t b = 0; b < rows; b++) {
    const uint8_t* row = from + b * columns;
    uint8_t* out = along + b * columns;
    for (size_t c = 1; c + 1 < columns; c++) out[c] = std::min(std::min(row[c - 1], row[c]), row[c + 1]);
    out[0] = std::min(row[0], row[1]);
    out[columns - 1] = std::min(row[columns - 2], row[columns - 1]);
  }
  for (size_t b = 0; b < rows; b++) {
    const uint8_t* before = along + (b == 0 ? 0 : b - 1) * columns;
    const uint8_t* here = along + b * columns;
    const uint8_t* after = along + std::min(b + 1, rows - 1) * columns;
    uint8_t* out = to + b * columns;
    for (size_t c = 0; c < columns; c++) out[c] = std::min(std::min(before[c], here[c]), after[c]);
  }
}

// One table, slice by slice against the direction. `free` is how many slices, from the one before on, are empty as far as a ray from anywhere in a cell can
// get; from the cell's own slice on that is as many for the cells around it there.
class Sweep {
 public:
  Sweep(const Slices& slices, const uint8_t* active, uint8_t* table)
      : slices_(slices),
        active_(active),
        table_(table),
        here_(slices.plane()),
        along_(slices.plane()),
        free_(slices.plane(), farthest),
        marks_(slices.plane()),
        words_(slices.axis[0] == 0 ? slices.plane() : 0) {
    for (size_t b = 0; b < slices.size[1]; b++) row_bytes_.push_back(slices.byte_of(slices.axis[1], b));
    for (size_t c = 0; c < slices.size[2]; c++) column_bytes_.push_back(slices.byte_of(slices.axis[2], c));
  }

  void run(bool ahead) {
    const size_t size = slices_.size[0];
    for (size_t step = 0; step < size; step++) {
      const size_t s = ahead ? size - 1 - step : step;
      load(s, step % cells_in_block == 0);
      next_slice();
      store(s, step % cells_in_block == cells_in_block - 1);
    }
  }

 private:
  // From whether cells are active to their distances.
  void next_slice() {
    for (size_t i = 0; i < marks_.size(); i++)
      here_[i] = marks_[i] != 0 ? uint8_t(0) : std::min(uint8_t(free_[i] + 1), farthest);
    spread(here_.data(), along_.data(), free_.data(), slices_.size[1], slices_.size[2]);
    for (size_t i = 0; i < marks_.size(); i++) marks_[i] = marks_[i] != 0 ? uint8_t(0) : std::max(free_[i], uint8_t(1));
  }

  // Four cells along x are a word. It belongs to a row of a slice, or, across x, to four slices, which are taken apart and put together here.
  void load(size_t s, bool first_of_four) {
    const size_t rows = slices_.size[1], columns = slices_.size[2];
    const bool is_across_x = slices_.axis[0] == 0;
    const uint8_t* from =
        active_ + slices_.byte_of(slices_.axis[0], is_across_x ? s / cells_in_block * cells_in_block : s);
    if (!is_across_x) {
      for (size_t b = 0; b < rows; b++) {
        for (size_t c = 0; c < columns; c += cells_in_block)
          std::memcpy(&marks_[b * columns + c], from + row_bytes_[b] + column_bytes_[c], cells_in_block);
      }
      return;
    }
    if (first_of_four) {
      for (size_t b = 0; b < rows; b++) {
        for (size_t c = 0; c < columns; c++)
          std::memcpy(&words_[b * columns + c], from + row_bytes_[b] + column_bytes_[c], cells_in_block);
      }
    }
    const unsigned shift = unsigned(8 * (s % cells_in_block));
    for (size_t i = 0; i < marks_.size(); i++) marks_[i] = uint8_t(words_[i] >> shift);
  }

  void store(size_t s, bool last_of_four) {
    const size_t rows = slices_.size[1], columns = slices_.size[2];
    const bool is_across_x = slices_.axis[0] == 0;
    uint8_t* to = table_ + slices_.byte_of(slices_.axis[0], is_across_x ? s / cells_in_block * cells_in_block : s);
    if (!is_across_x) {
      for (size_t b = 0; b < rows; b++) {
        for (size_t c = 0; c < columns; c += cells_in_block)
          std::memcpy(to + row_bytes_[b] + column_bytes_[c], &marks_[b * columns + c], cells_in_block);
      }
      return;
    }
    const unsigned shift = unsigned(8 * (s % cells_in_block));
    const std::uint32_t others = ~(0xffu << shift);
    for (size_t i = 0; i < marks_.size(); i++) words_[i] = (words_[i] & others) | std::uint32_t(marks_[i]) << shift;
    if (!last_of_four) return;
    for (size_t b = 0; b < rows; b++) {
      for (size_t c = 0; c < columns; c++)
        std::memcpy(to + row_bytes_[b] + column_bytes_[c], &words_[b * columns + c], cells_in_block);
    }
  }

  const Slices& slices_;
  const uint8_t* active_;
  uint8_t* table_;
  std::vector<uint8_t> here_, along_, free_, marks_;
  std::vector<std::uint32_t> words_;
  std::vector<size_t> row_bytes_, column_bytes_;
};

}  // namespace

Values<uint8_t> directed_distances(std::span<const glm::uvec2> active, glm::ivec3 blocks) {
  constexpr size_t tables = 6, bytes = 64;
  std::vector<uint8_t> cells(bytes * active.size());
  parallel_for(size_t(blocks.z), [&](size_t z) {
    const size_t layer = size_t(blocks.x) * size_t(blocks.y);
    for (size_t block = z * layer; block < (z + 1) * layer; block++) {
      if (active[block] == glm::uvec2(0)) continue;
      for (size_t i = 0; i < bytes; i++)
        cells[bytes * block + i] = uint8_t(active[block][i < 32 ? 0 : 1] >> (i % 32) & 1);
    }
  });
  Values<uint8_t> distances(tables * cells.size());
  parallel_for(tables, [&](size_t table) {
    const Slices slices = slices_across(int(table / 2), blocks);
    Sweep(slices, cells.data(), distances.data() + table * cells.size()).run(table % 2 == 0);
  });
  return distances;
}

}  // namespace smurf
