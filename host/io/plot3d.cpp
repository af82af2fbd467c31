#include "io/plot3d.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "numerics/input_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

// The greatest number of blocks that is taken for one. Overset grids have thousands.
constexpr std::int32_t most_blocks = 1 << 20;
constexpr std::int64_t most_nodes = std::numeric_limits<std::int32_t>::max();
constexpr std::int32_t greatest_dimension = 1 << 30;
constexpr std::size_t marker = 4;  // bytes of a record's length, before and after the record

enum class FileKind { grid, solution };

struct Layout {
  bool big_endian = false;
  bool records = false;
  bool counted = false;
  bool blanking = false;
  std::size_t real = 4;  // bytes of a number
  std::vector<glm::ivec3> sizes;

  std::size_t nodes(std::size_t block) const {
    return std::size_t(sizes[block].x) * std::size_t(sizes[block].y) * std::size_t(sizes[block].z);
  }
};

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

// ---- Numbers in the file's byte order

std::uint32_t swapped(std::uint32_t v) { return (v >> 24) | ((v >> 8) & 0xff00U) | ((v << 8) & 0xff0000U) | (v << 24); }

std::uint64_t swapped(std::uint64_t v) {
  return (std::uint64_t(swapped(std::uint32_t(v))) << 32) | swapped(std::uint32_t(v >> 32));
}

template <class Bits>
Bits bits_at(const char* bytes, bool big_endian) {
  Bits bits;
  std::memcpy(&bits, bytes, sizeof bits);
  return big_endian == (std::endian::native == std::endian::big) ? bits : swapped(bits);
}

double real_at(const char* bytes, const Layout& layout) {
  if (layout.real == 4) return double(std::bit_cast<float>(bits_at<std::uint32_t>(bytes, layout.big_endian)));
  return std::bit_cast<double>(bits_at<std::uint64_t>(bytes, layout.big_endian));
}

std::int32_t integer_in(const InputFile& file, std::size_t offset, bool big_endian) {
  char bytes[4];
  file.read_at(offset, bytes, sizeof bytes);
  return std::int32_t(bits_at<std::uint32_t>(bytes, big_endian));
}

// ---- Layouts

// Records in front of the blocks: the number of blocks, where there is one, and the sizes.
std::size_t header_bytes(const Layout& layout) {
  const std::size_t around = layout.records ? 2 * marker : 0;
  return (layout.counted ? 4 + around : 0) + 12 * layout.sizes.size() + around;
}

// Lengths of the records of one block, without their markers.
std::vector<std::size_t> records_of_block(const Layout& layout, FileKind kind, std::size_t block) {
  const std::size_t nodes = layout.nodes(block);
  if (kind == FileKind::grid) return {nodes * (3 * layout.real + (layout.blanking ? 4 : 0))};
  return {4 * layout.real, nodes * 5 * layout.real};
}

std::size_t file_bytes(const Layout& layout, FileKind kind) {
  std::size_t bytes = header_bytes(layout);
  for (std::size_t block = 0; block < layout.sizes.size(); block++) {
    for (const std::size_t record : records_of_block(layout, kind, block))
      bytes += record + (layout.records ? 2 * marker : 0);
  }
  return bytes;
}

// Whether the file begins as this layout does; then `layout.sizes` are filled in.
bool read_header(const InputFile& file, Layout& layout) {
  std::size_t offset = 0;
  const auto has = [&](std::size_t bytes) { return offset + bytes <= file.size(); };
  const auto next = [&] {
    const std::int32_t value = integer_in(file, offset, layout.big_endian);
    offset += 4;
    return value;
  };
  const auto passes_marker = [&](std::int32_t length) { return !layout.records || (has(marker) && next() == length); };
  std::int32_t blocks = 1;
  if (layout.counted) {
    if (!passes_marker(4) || !has(4)) return false;
    blocks = next();
    if (blocks < 1 || blocks > most_blocks || !passes_marker(4)) return false;
  }
  if (!passes_marker(12 * blocks) || !has(12 * std::size_t(blocks))) return false;
  for (std::int32_t block = 0; block < blocks; block++) {
    std::int64_t nodes = 1;
    glm::ivec3 size;
    for (int axis = 0; axis < 3; axis++) {
      size[axis] = next();
      if (size[axis] < 1 || size[axis] > greatest_dimension) return false;
      nodes *= size[axis];
      if (nodes > most_nodes) return false;
    }
    layout.sizes.push_back(size);
  }
  return passes_marker(12 * blocks);
}

// Whether every record has its length before and after it.
bool records_fit(const InputFile& file, const Layout& layout, FileKind kind) {
  std::vector<std::size_t> lengths;
  if (layout.counted) lengths.push_back(4);
  lengths.push_back(12 * layout.sizes.size());
  for (std::size_t block = 0; block < layout.sizes.size(); block++) {
    const std::vector<std::size_t> records = records_of_block(layout, kind, block);
    lengths.insert(lengths.end(), records.begin(), records.end());
  }
  std::size_t offset = 0;
  for (const std::size_t length : lengths) {
    for (const std::size_t at : {offset, offset + marker + length}) {
      if (std::uint32_t(integer_in(file, at, layout.big_endian)) != length) return false;
    }
    offset += length + 2 * marker;
  }
  return true;
}

std::string shown(const std::vector<glm::ivec3>& sizes) {
  constexpr std::size_t most_shown = 4;
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < std::min(most_shown, sizes.size()); i++)
    texts.push_back(fmt::format("{}x{}x{}", sizes[i].x, sizes[i].y, sizes[i].z));
  return fmt::format("{} of {}{}", sizes.size() == 1 ? "one block" : fmt::format("{} blocks", sizes.size()),
                     fmt::join(texts, ", "), sizes.size() > most_shown ? ", ..." : "");
}

std::string numbers_of(const Layout& layout, FileKind kind) {
  return fmt::format("float{}{}", 8 * layout.real,
                     kind == FileKind::solution ? ""
                     : layout.blanking          ? " with iblank"
                                                : " without iblank");
}

std::string structure_of(const Layout& layout) {
  return fmt::format("{}-endian, {}{}, {}", layout.big_endian ? "big" : "little", shown(layout.sizes),
                     layout.counted ? " after their number" : " without a number of blocks",
                     layout.records ? "Fortran records" : "no records");
}

std::string named(const Layout& layout, FileKind kind) {
  return fmt::format("{}, {}", structure_of(layout), numbers_of(layout, kind));
}

// Every combination whose header makes sense.
std::vector<Layout> headers_of(const InputFile& file, FileKind kind) {
  std::vector<Layout> found;
  for (unsigned choice = 0; choice < 32; choice++) {
    Layout layout;
    layout.blanking = (choice & 1) != 0;
    layout.real = (choice & 2) != 0 ? 8 : 4;
    layout.big_endian = (choice & 4) != 0;
    layout.records = (choice & 8) != 0;
    layout.counted = (choice & 16) != 0;
    if (layout.blanking && kind == FileKind::solution) continue;
    if (read_header(file, layout)) found.push_back(std::move(layout));
  }
  // Markers about the sizes are no chance: 12 57 33 25 12 is no grid of 12x57x33 nodes.
  if (std::ranges::any_of(found, &Layout::records))
    std::erase_if(found, [](const Layout& layout) { return !layout.records; });
  return found;
}

constexpr std::string_view what_is_tried =
    "tried are both byte orders, with and without Fortran records, number of blocks and (grids) iblank, float32 and "
    "float64";

std::vector<Layout> layouts_of(const InputFile& file, FileKind kind) {
  const std::vector<Layout> headers = headers_of(file, kind);
  std::vector<Layout> fitting;
  for (const Layout& layout : headers) {
    if (file_bytes(layout, kind) == file.size() && (!layout.records || records_fit(file, layout, kind)))
      fitting.push_back(layout);
  }
  if (!fitting.empty()) return fitting;
  std::string text = fmt::format("{} bytes fit no layout of a PLOT3D {} file", file.size(),
                                 kind == FileKind::grid ? "grid" : "solution");
  if (headers.empty()) {
    text += "; the beginning holds no sizes of blocks that make sense";
  } else {
    std::string structure;  // alike for up to four layouts that follow each other
    for (const Layout& layout : headers) {
      const std::string next = structure_of(layout);
      const std::string size = fmt::format("{} bytes as {}", file_bytes(layout, kind), numbers_of(layout, kind));
      text += next == structure ? fmt::format(", {}", size) : fmt::format("; expected for {}: {}", next, size);
      structure = next;
    }
  }
  fail(file.path(), fmt::format("{}; {}", text, what_is_tried));
}

// The layouts of the two files: the one pair that agrees in its blocks.
std::pair<Layout, Layout> agreed(const InputFile& grid, const InputFile& solution) {
  const std::vector<Layout> grids = layouts_of(grid, FileKind::grid);
  const std::vector<Layout> solutions = layouts_of(solution, FileKind::solution);
  std::vector<std::pair<Layout, Layout>> pairs;
  for (const Layout& one : grids) {
    for (const Layout& other : solutions) {
      if (one.sizes == other.sizes) pairs.emplace_back(one, other);
    }
  }
  if (pairs.empty())
    fail(solution.path(), fmt::format("the solution has {}, but the grid \"{}\" has {}; they must agree",
                                      shown(solutions[0].sizes), grid.path().string(), shown(grids[0].sizes)));
  if (pairs.size() > 1) {
    std::vector<std::string> fits;
    for (const auto& [one, other] : pairs)
      fits.push_back(
          fmt::format("grid {} with solution {}", named(one, FileKind::grid), named(other, FileKind::solution)));
    fail(grid.path(), fmt::format("{} layouts fit, and nothing tells which is right: {}; {}", pairs.size(),
                                  fmt::join(fits, "; or "), what_is_tried));
  }
  return pairs[0];
}

// ---- Data

// Lists of numbers that follow each other in a block.
class BlockReader {
 public:
  BlockReader(const InputFile& file, const Layout& layout) : file_(file), layout_(layout) {
    offset_ = header_bytes(layout);
  }

  void begin_record() { offset_ += layout_.records ? marker : 0; }
  void end_record() { begin_record(); }
  void skip(std::size_t reals) { offset_ += reals * layout_.real; }

  // Calls take(index, value) for `count` numbers.
  template <class Take>
  void reals(std::size_t count, Take take) {
    each(count, layout_.real, [&](std::size_t i, const char* bytes) { take(i, real_at(bytes, layout_)); });
  }
  template <class Take>
  void integers(std::size_t count, Take take) {
    each(count, 4, [&](std::size_t i, const char* bytes) {
      take(i, std::int32_t(bits_at<std::uint32_t>(bytes, layout_.big_endian)));
    });
  }

 private:
  template <class Take>
  void each(std::size_t count, std::size_t width, Take take) {
    constexpr std::size_t chunk = 1 << 16;
    for (std::size_t first = 0; first < count; first += chunk) {
      const std::size_t numbers = std::min(chunk, count - first);
      bytes_.resize(numbers * width);
      file_.read_at(offset_, bytes_.data(), bytes_.size());
      offset_ += bytes_.size();
      for (std::size_t i = 0; i < numbers; i++) take(first + i, bytes_.data() + i * width);
    }
  }

  const InputFile& file_;
  const Layout& layout_;
  std::size_t offset_ = 0;
  std::vector<char> bytes_;
};

void read_grid(const InputFile& file, const Layout& layout, std::vector<CurvilinearBlock>& blocks) {
  BlockReader reader(file, layout);
  for (std::size_t b = 0; b < blocks.size(); b++) {
    CurvilinearBlock& block = blocks[b];
    const std::size_t nodes = layout.nodes(b);
    block.size = layout.sizes[b];
    block.points.resize(nodes);
    reader.begin_record();
    for (int axis = 0; axis < 3; axis++)
      reader.reals(nodes, [&](std::size_t i, double value) { block.points[i][axis] = value; });
    if (layout.blanking) {
      block.blanked.resize(nodes);
      reader.integers(nodes, [&](std::size_t i, std::int32_t value) { block.blanked[i] = value == 0 ? 1 : 0; });
      if (std::ranges::find(block.blanked, 1) == block.blanked.end()) block.blanked.clear();
    }
    reader.end_record();
  }
}

// Density, three momenta, and the energy, which is not needed.
void read_solution(const InputFile& file, const Layout& layout, std::vector<CurvilinearBlock>& blocks) {
  BlockReader reader(file, layout);
  std::vector<double> density;
  for (std::size_t b = 0; b < blocks.size(); b++) {
    const std::size_t nodes = layout.nodes(b);
    blocks[b].vectors.resize(nodes);
    density.resize(nodes);
    reader.begin_record();
    reader.skip(4);  // Mach number, angle of attack, Reynolds number, time
    reader.end_record();
    reader.begin_record();
    reader.reals(nodes, [&](std::size_t i, double value) {
      const bool usable = std::isfinite(value) && value != 0;
      density[i] = usable ? value : std::numeric_limits<double>::quiet_NaN();
    });
    for (int axis = 0; axis < 3; axis++)
      reader.reals(nodes, [&](std::size_t i, double value) { blocks[b].vectors[i][axis] = float(value / density[i]); });
    reader.skip(nodes);
    reader.end_record();
  }
}

}  // namespace

Plot3d read_plot3d(const path& grid, const path& solution) {
  const InputFile grid_file(grid), solution_file(solution);
  const auto [grid_layout, solution_layout] = agreed(grid_file, solution_file);
  Plot3d result;
  result.blocks.resize(grid_layout.sizes.size());
  read_grid(grid_file, grid_layout, result.blocks);
  read_solution(solution_file, solution_layout, result.blocks);
  result.layout = {{"PLOT3D grid", named(grid_layout, FileKind::grid)},
                   {"PLOT3D solution", named(solution_layout, FileKind::solution)}};
  return result;
}

}  // namespace smurf
