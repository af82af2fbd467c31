// The distances that rays of a direction are walked by, against a count of all cells that such a ray could meet.
#include "surfaces/directed_distances.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace smurf::test {
namespace {

constexpr int farthest = 250;

class Cells {
 public:
  Cells(glm::ivec3 blocks, double density, unsigned seed)
      : blocks_(blocks), bits_(std::size_t(blocks.x) * std::size_t(blocks.y) * std::size_t(blocks.z)) {
    std::mt19937 random(seed);
    std::bernoulli_distribution active(density);
    for (glm::uvec2& block : bits_) {
      for (int bit = 0; bit < 64; bit++) block[bit / 32] |= std::uint32_t(active(random)) << (bit % 32);
    }
  }
  const std::vector<glm::uvec2>& bits() const { return bits_; }
  glm::ivec3 blocks() const { return blocks_; }
  glm::ivec3 size() const { return 4 * blocks_; }
  std::size_t block_of(glm::ivec3 c) const {
    return std::size_t(c.x / 4 + blocks_.x * (c.y / 4 + blocks_.y * (c.z / 4)));
  }
  static int bit_of(glm::ivec3 c) { return c.x % 4 + 4 * (c.y % 4) + 16 * (c.z % 4); }
  bool active(glm::ivec3 c) const {
    if (glm::any(glm::lessThan(c, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(c, size()))) return false;
    const int bit = bit_of(c);
    return (bits_[block_of(c)][bit / 32] >> (bit % 32) & 1) != 0;
  }

 private:
  glm::ivec3 blocks_;
  std::vector<glm::uvec2> bits_;
};

int expected_distance(const Cells& cells, glm::ivec3 cell, int axis, int step) {
  if (cells.active(cell)) return 0;
  const int across = (axis + 1) % 3, other = (axis + 2) % 3;
  for (int ahead = 0;; ahead++) {
    glm::ivec3 c = cell;
    c[axis] += step * ahead;
    if (c[axis] < 0 || c[axis] >= cells.size()[axis]) return farthest;
    // Outside of the grid nothing is active.
    const auto from = [&](int of) { return std::max(cell[of] - ahead - 1, 0); };
    const auto to = [&](int of) { return std::min(cell[of] + ahead + 1, cells.size()[of] - 1); };
    for (c[across] = from(across); c[across] <= to(across); c[across]++) {
      for (c[other] = from(other); c[other] <= to(other); c[other]++) {
        if (cells.active(c)) return std::max(ahead, 1);
      }
    }
  }
}

void check(const Cells& cells) {
  const std::vector<std::uint8_t> found = [&] {
    const auto tables = directed_distances(cells.bits(), cells.blocks());
    return std::vector<std::uint8_t>(tables.begin(), tables.end());
  }();
  ASSERT_EQ(found.size(), 6 * 64 * cells.bits().size());
  for (int table = 0; table < 6; table++) {
    for (int z = 0; z < cells.size().z; z++) {
      for (int y = 0; y < cells.size().y; y++) {
        for (int x = 0; x < cells.size().x; x++) {
          const glm::ivec3 c(x, y, z);
          const std::size_t at =
              64 * (std::size_t(table) * cells.bits().size() + cells.block_of(c)) + std::size_t(Cells::bit_of(c));
          ASSERT_EQ(int(found[at]), expected_distance(cells, c, table / 2, table % 2 == 0 ? 1 : -1))
              << "table " << table << ", cell " << x << ", " << y << ", " << z;
        }
      }
    }
  }
}

TEST(DirectedDistances, AreThoseOfTheEmptyPyramid) {
  check(Cells({5, 3, 4}, 0.01, 1));
  check(Cells({2, 6, 3}, 0.1, 2));
  check(Cells({4, 2, 7}, 0.001, 3));
}

TEST(DirectedDistances, OneBlockAndNoneActive) {
  check(Cells({1, 1, 1}, 0.05, 4));
  check(Cells({1, 1, 1}, 1, 5));
  check(Cells({3, 1, 2}, 0, 6));
}

// Farther than a byte can tell.
TEST(DirectedDistances, LongGrids) { check(Cells({70, 1, 1}, 0.0005, 7)); }

}  // namespace
}  // namespace smurf::test
