#include "surfaces/grid/active_cells.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "device/program.hpp"
#include "kernels/grid/layout.inc"

namespace smurf {
namespace {

constexpr int block_cells = ActiveCells::block_cells;
constexpr int block_rows = 16;     // of cells along x, a word of distances each
constexpr int farthest_skip = 64;  // blocks; distances of their cells must fit a byte

// The box of cells whose bits are set, [low, high).
struct CellBox {
  glm::ivec3 low{std::numeric_limits<int>::max()};
  glm::ivec3 high{std::numeric_limits<int>::min()};
  void add(glm::ivec3 block, std::uint64_t bits) {
    std::uint64_t in_plane = 0;  // bit x + 4y
    for (int z = 0; z < block_cells; z++) {
      const std::uint64_t plane = (bits >> (16 * z)) & 0xffff;
      if (plane != 0) extend(2, block_cells * block.z + z);
      in_plane |= plane;
    }
    for (int y = 0; y < block_cells; y++) {
      if ((in_plane >> (4 * y)) & 0xf) extend(1, block_cells * block.y + y);
    }
    for (int x = 0; x < block_cells; x++) {
      if ((in_plane >> x) & 0x1111) extend(0, block_cells * block.x + x);
    }
  }
  void extend(int axis, int cell) {
    low[axis] = std::min(low[axis], cell);
    high[axis] = std::max(high[axis], cell + 1);
  }
};

// Distance of every block to the nearest one with distance 0, in blocks and the maximum norm: two sweeps over
// the 13 neighbours before and after (Rosenfeld, Pfaltz 1968; exact for this norm).
void spread_distances(std::vector<std::uint8_t>& distance, glm::ivec3 blocks) {
  const auto sweep = [&](int direction) {
    const std::int64_t count = std::int64_t(blocks.x) * blocks.y * blocks.z;
    for (std::int64_t n = 0; n < count; n++) {
      const std::int64_t index = direction > 0 ? n : count - 1 - n;
      int nearest = distance[std::size_t(index)];
      if (nearest == 0) continue;
      const int x = int(index % blocks.x), y = int(index / blocks.x % blocks.y), z = int(index / blocks.x / blocks.y);
      for (int neighbour = 0; neighbour < 13; neighbour++) {
        const int dx = direction * (neighbour % 3 - 1), dy = direction * (neighbour / 3 % 3 - 1),
                  dz = direction * (neighbour / 9 - 1);
        const int nx = x + dx, ny = y + dy, nz = z + dz;
        if (nx < 0 || ny < 0 || nz < 0 || nx >= blocks.x || ny >= blocks.y || nz >= blocks.z) continue;
        nearest = std::min(nearest, distance[std::size_t((std::int64_t(nz) * blocks.y + ny) * blocks.x + nx)] + 1);
      }
      distance[std::size_t(index)] = std::uint8_t(nearest);
    }
  };
  sweep(1);
  sweep(-1);
}

// A step between elements that is taken by two shifts and a sum, which is sooner done than a product: the least 2^a +
// 2^b not below n.
class ShiftStep {
 public:
  explicit ShiftStep(std::int64_t n) {
    const auto at_least = std::uint64_t(std::max<std::int64_t>(n, 2));
    high_ = std::bit_width(at_least) - 1;
    const std::uint64_t rest = at_least - (std::uint64_t(1) << high_);
    if (rest == 0) high_--;
    low_ = rest == 0 ? high_ : std::bit_width(rest - 1);
  }
  int low() const { return low_; }
  int high() const { return high_; }
  std::int64_t size() const { return (std::int64_t(1) << low_) + (std::int64_t(1) << high_); }

 private:
  int low_ = 0, high_ = 0;
};

// Distances of rows and slices of blocks: so many words apart.
ShiftStep row_step(glm::ivec3 blocks) { return ShiftStep(std::int64_t(block_rows) * blocks.x); }
ShiftStep slice_step(glm::ivec3 blocks) { return ShiftStep(row_step(blocks).size() * blocks.y); }

}  // namespace

ActiveCells::ActiveCells(Executor& executor, glm::ivec3 cells, const Texts& modules, const Texts& defines,
                         DeviceBuffer& uniforms, DeviceBuffer& samples, DeviceBuffer& bounds)
    : executor_(executor),
      modules_(modules),
      defines_(defines),
      uniforms_(uniforms),
      samples_(samples),
      bounds_(bounds),
      blocks_(blocks_of(cells)),
      bits_(executor, block_count(), "active cells"),
      skips_(executor, (block_count() + 3) / 4, "block distances"),
      distances_(executor, std::size_t(slice_step(blocks_).size()) * std::size_t(blocks_.z), "cell distances") {}

void ActiveCells::define_traversal(Texts& defines, glm::ivec3 cells, bool aligned) {
  // Floats that are read as places have 14 bits or more for a cell's fraction; with fewer a traversal would be less
  // exact than by plain floats.
  constexpr int most_by_bits = 512;
  defines["TRAVERSAL_BY_BITS"] = std::max({cells.x, cells.y, cells.z}) <= most_by_bits ? "1" : "0";
  defines["GRID_ALIGNED"] = aligned ? "1" : "0";
}

std::vector<glm::uvec2> ActiveCells::find() {
  std::vector<glm::uvec2> bits(block_count());
  launch(executor_, Program{KernelId::grid_activate, modules_, defines_},
         arguments::grid_activate{.uniforms = &uniforms_,
                                  .samples = &samples_,
                                  .bounds = &bounds_,
                                  .cells = bits_.get(),
                                  .count = int(block_count())},
         block_count());
  bits_.read(bits);
  return bits;
}

void ActiveCells::activate(std::span<const glm::uvec2> bits, glm::vec3 extent) {
  bits_.write(bits);
  CellBox box;
  std::vector<std::uint8_t> distance(skips_.bytes(), farthest_skip);
  for (std::size_t i = 0; i < bits.size(); i++) {
    const std::uint64_t word = bits[i].x | std::uint64_t(bits[i].y) << 32;
    if (word == 0) continue;
    distance[i] = 0;
    const int index = int(i);
    box.add({index % blocks_.x, index / blocks_.x % blocks_.y, index / blocks_.x / blocks_.y}, word);
  }
  spread_distances(distance, blocks_);
  const ShiftStep row = row_step(blocks_), slice = slice_step(blocks_);
  const std::array<std::int32_t, 4> steps = {row.low(), row.high(), slice.low(), slice.high()};
  executor_.write(uniforms_, GRID_DISTANCE_STEPS * 4, steps.data(), sizeof steps);
  executor_.write(*skips_.get(), 0, distance.data(), distance.size());
  launch(executor_, Program{KernelId::grid_distances, modules_, defines_},
         arguments::grid_distances{.uniforms = &uniforms_,
                                   .samples = &samples_,
                                   .cells = bits_.get(),
                                   .skips = skips_.get(),
                                   .distances = distances_.get(),
                                   .count = int(block_count())},
         block_count());
  // Without an active cell any cell will do: nothing is found there.
  const bool empty = box.low.x > box.high.x;
  const glm::vec3 low = empty ? glm::vec3(0) : glm::vec3(box.low);
  const glm::vec3 high = glm::min(empty ? glm::vec3(1) : glm::vec3(box.high), extent);
  const std::array<float, 6> reals = {low.x, low.y, low.z, high.x, high.y, high.z};
  executor_.write(uniforms_, GRID_LOWER * 4, reals.data(), sizeof reals);
  const float bias = float(std::bit_ceil(unsigned(block_cells * std::max({blocks_.x, blocks_.y, blocks_.z}))));
  executor_.write(uniforms_, GRID_BIAS * 4, &bias, sizeof bias);
}

}  // namespace smurf
