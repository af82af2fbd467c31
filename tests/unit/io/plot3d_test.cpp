// PLOT3D files in every layout, written here byte by byte: read back, cut short, and files that do not belong together.
#include "io/plot3d.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "harness/files/test_files.hpp"
#include "harness/refusal.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::get;
using test::put;
using test::refusal;
using test::test_folder;

const fs::path data = fs::path(SMURF_SOURCE_DIR) / "host/data/flows";

struct Form {
  bool big_endian = false, records = false, counted = false, blanking = false, doubles = false;
};

std::vector<Form> all_forms() {
  std::vector<Form> forms;
  for (unsigned i = 0; i < 32; i++)
    forms.push_back({(i & 1) != 0, (i & 2) != 0, (i & 4) != 0, (i & 8) != 0, (i & 16) != 0});
  return forms;
}

struct TestBlock {
  glm::ivec3 size{0};
  std::vector<double> x[3], iblank, q[5];  // whole numbers in iblank
  std::size_t nodes() const { return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z); }
};

TestBlock make_block(glm::ivec3 size, unsigned seed) {
  TestBlock block;
  block.size = size;
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> numbers(-1000, 1000);
  for (std::size_t i = 0; i < block.nodes(); i++) {
    for (auto& list : block.x) list.push_back(numbers(random) / 64.0);
    for (auto& list : block.q) list.push_back(numbers(random) / 64.0);
    block.q[0].back() = 1 + double(i % 7);  // a density
    block.iblank.push_back(i % 5 == 0 ? 0 : i % 5 == 1 ? -3 : 1);
  }
  return block;
}

class Writer {
 public:
  explicit Writer(const Form& form) : form_(form) {}

  void integer(std::int32_t value) { add(std::bit_cast<std::uint32_t>(value)); }
  void real(double value) {
    if (form_.doubles) add(std::bit_cast<std::uint64_t>(value));
    else add(std::bit_cast<std::uint32_t>(float(value)));
  }
  // What was added since the last record becomes one.
  void end_record() {
    const std::string content = bytes_.substr(begin_);
    if (form_.records) {
      bytes_.resize(begin_);
      integer(std::int32_t(content.size()));
      bytes_ += content;
      integer(std::int32_t(content.size()));
    }
    begin_ = bytes_.size();
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class Bits>
  void add(Bits bits) {
    char raw[sizeof bits];
    std::memcpy(raw, &bits, sizeof bits);
    if (form_.big_endian != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof bits);
    bytes_.append(raw, sizeof bits);
  }

  Form form_;
  std::string bytes_;
  std::size_t begin_ = 0;
};

void write_header(Writer& out, const Form& form, const std::vector<TestBlock>& blocks) {
  if (form.counted) {
    out.integer(std::int32_t(blocks.size()));
    out.end_record();
  }
  for (const TestBlock& block : blocks)
    for (int a = 0; a < 3; a++) out.integer(block.size[a]);
  out.end_record();
}

std::string grid_bytes(const Form& form, const std::vector<TestBlock>& blocks) {
  Writer out(form);
  write_header(out, form, blocks);
  for (const TestBlock& block : blocks) {
    for (const auto& list : block.x)
      for (const double value : list) out.real(value);
    if (form.blanking)
      for (const double value : block.iblank) out.integer(std::int32_t(value));
    out.end_record();
  }
  return out.bytes();
}

std::string solution_bytes(const Form& form, const std::vector<TestBlock>& blocks) {
  Writer out(form);
  write_header(out, form, blocks);
  for (const TestBlock& block : blocks) {
    for (const double value : {0.5, 2.0, 1e5, 0.0}) out.real(value);
    out.end_record();
    for (const auto& list : block.q)
      for (const double value : list) out.real(value);
    out.end_record();
  }
  return out.bytes();
}

Plot3d load(const std::string& grid, const std::string& solution) {
  const fs::path folder = test_folder();
  return read_plot3d(put(folder / "grid.xyz", grid), put(folder / "flow.q", solution));
}

void expect_same(const CurvilinearBlock& read, const TestBlock& made, bool blanking) {
  ASSERT_EQ(read.size, made.size);
  ASSERT_EQ(read.points.size(), made.nodes());
  ASSERT_EQ(read.vectors.size(), made.nodes());
  ASSERT_EQ(read.blanked.size(), blanking ? made.nodes() : 0);
  for (std::size_t i = 0; i < made.nodes(); i++) {
    for (int a = 0; a < 3; a++) {
      ASSERT_EQ(read.points[i][a], made.x[a][i]);  // multiples of 1/64, exact in float32 as well
      ASSERT_EQ(read.vectors[i][a], float(made.q[a + 1][i] / made.q[0][i]));
    }
    if (blanking) {
      ASSERT_EQ(read.blanked[i] != 0, made.iblank[i] == 0);
    }
  }
}

TEST(Plot3d, every_layout) {
  const std::vector<TestBlock> one{make_block({4, 3, 5}, 1)};
  const std::vector<TestBlock> several{make_block({4, 3, 5}, 1), make_block({2, 2, 2}, 2), make_block({3, 7, 2}, 3)};
  int checked = 0;
  for (const Form& form : all_forms()) {
    for (const auto& blocks : {one, several}) {
      if (blocks.size() > 1 && !form.counted) continue;  // PLOT3D has no such files
      const Plot3d read = load(grid_bytes(form, blocks), solution_bytes(form, blocks));
      ASSERT_EQ(read.blocks.size(), blocks.size());
      for (std::size_t b = 0; b < blocks.size(); b++) expect_same(read.blocks[b], blocks[b], form.blanking);
      ASSERT_EQ(read.layout.size(), 2u);
      const std::string said = read.layout[0].value;
      EXPECT_EQ(said.find("big-endian") != said.npos, form.big_endian) << said;
      EXPECT_EQ(said.find("float64") != said.npos, form.doubles) << said;
      EXPECT_EQ(said.find("after their number") != said.npos, form.counted) << said;
      EXPECT_EQ(said.find("with iblank") != said.npos, form.blanking) << said;
      EXPECT_EQ(said.find("Fortran records") != said.npos, form.records) << said;
      EXPECT_NE(said.find("4x3x5"), said.npos) << said;
      checked++;
    }
  }
  EXPECT_EQ(checked, 48);
}

TEST(Plot3d, grid_and_solution_may_be_written_differently) {
  const std::vector<TestBlock> blocks{make_block({3, 4, 2}, 4)};
  const Form grid{.big_endian = true, .records = true, .blanking = true, .doubles = true};
  const Form solution{.counted = true};
  expect_same(load(grid_bytes(grid, blocks), solution_bytes(solution, blocks)).blocks[0], blocks[0], true);
}

TEST(Plot3d, nothing_blanked_is_no_list) {
  std::vector<TestBlock> blocks{make_block({3, 4, 2}, 4)};
  blocks[0].iblank.assign(blocks[0].nodes(), -1);
  const Form form{.blanking = true};
  EXPECT_TRUE(load(grid_bytes(form, blocks), solution_bytes(form, blocks)).blocks[0].blanked.empty());
}

TEST(Plot3d, densities_that_are_none_give_no_vectors) {
  std::vector<TestBlock> blocks{make_block({2, 2, 2}, 5)};
  blocks[0].q[0] = {0, -0.0, NAN, INFINITY, 1, 2, -4, 1};
  blocks[0].q[1] = {0, 1, 1, 1, 3, 3, 3, NAN};
  const Plot3d read = load(grid_bytes({}, blocks), solution_bytes({}, blocks));
  const auto& vectors = read.blocks[0].vectors;
  for (std::size_t i = 0; i < 4; i++)
    for (int a = 0; a < 3; a++) EXPECT_TRUE(std::isnan(vectors[i][a])) << i;
  EXPECT_EQ(vectors[4].x, 3.0f);
  EXPECT_EQ(vectors[5].x, 1.5f);
  EXPECT_EQ(vectors[6].x, -0.75f);
  EXPECT_TRUE(std::isnan(vectors[7].x));
}

// No part of a file is a file: an error with both sizes, whatever the layout.
TEST(Plot3d, refuses_files_that_are_cut_short) {
  const std::vector<TestBlock> blocks{make_block({4, 3, 5}, 1), make_block({2, 2, 2}, 2), make_block({3, 7, 2}, 3)};
  for (const Form& form : all_forms()) {
    const std::vector<TestBlock> written(blocks.begin(), blocks.begin() + (form.counted ? 3 : 1));
    const std::string grid = grid_bytes(form, written), solution = solution_bytes(form, written);
    for (std::size_t bytes = 0; bytes < grid.size(); bytes += 97) {
      const std::string message = refusal(ErrorCode::input, [&] { load(grid.substr(0, bytes), solution); });
      EXPECT_NE(message.find("grid.xyz\": " + std::to_string(bytes) + " bytes fit no layout"), message.npos) << message;
      if (bytes > 100) {
        EXPECT_NE(message.find(std::to_string(grid.size()) + " bytes as"), message.npos) << message;
      }
    }
    for (std::size_t bytes = 0; bytes < solution.size(); bytes += 97) {
      const std::string message = refusal(ErrorCode::input, [&] { load(grid, solution.substr(0, bytes)); });
      EXPECT_NE(message.find("flow.q\": " + std::to_string(bytes) + " bytes fit no layout"), message.npos) << message;
      if (bytes > 100) {
        EXPECT_NE(message.find(std::to_string(solution.size()) + " bytes as"), message.npos) << message;
      }
    }
    EXPECT_REFUSED(load(grid + 'x', solution), "fit no layout");
    EXPECT_REFUSED(load(grid, solution + "1234"), "fit no layout");
  }
}

TEST(Plot3d, refuses_records_of_the_wrong_length) {
  const std::vector<TestBlock> blocks{make_block({4, 3, 5}, 1)};
  const Form form{.records = true, .counted = true};
  std::string grid = grid_bytes(form, blocks);
  grid[grid.size() - 3] ^= 1;  // of the last marker
  EXPECT_REFUSED(load(grid, solution_bytes(form, blocks)), "fit no layout");
}

TEST(Plot3d, refuses_files_that_do_not_belong_together) {
  const std::vector<TestBlock> one{make_block({4, 3, 5}, 1)}, other{make_block({4, 5, 3}, 1)};
  EXPECT_REFUSED(load(grid_bytes({}, one), solution_bytes({}, other)), "one block of 4x5x3");
  EXPECT_REFUSED(load(grid_bytes({}, one), solution_bytes({}, other)), "one block of 4x3x5");
  const std::vector<TestBlock> two{one[0], other[0]};
  const Form counted{.counted = true};
  EXPECT_REFUSED(load(grid_bytes(counted, one), solution_bytes(counted, two)), "2 blocks of 4x3x5, 4x5x3");
}

TEST(Plot3d, refuses_what_is_no_plot3d_file) {
  const fs::path folder = test_folder();
  const std::vector<TestBlock> blocks{make_block({4, 3, 5}, 1)};
  const std::string grid = grid_bytes({}, blocks), solution = solution_bytes({}, blocks);
  EXPECT_REFUSED(load(std::string(1000, '\xff'), solution), "no sizes of blocks that make sense");
  EXPECT_REFUSED(load(solution, solution), "fit no layout of a PLOT3D grid");
  EXPECT_REFUSED(load(grid, grid), "fit no layout of a PLOT3D solution");
  EXPECT_REFUSED(load("", solution), "0 bytes fit no layout");
  EXPECT_REFUSED(read_plot3d(folder / "missing.xyz", folder / "flow.q"), "missing.xyz\": No such file");
  EXPECT_REFUSED(read_plot3d(folder / "grid.xyz", folder), "no regular file");
}

// Four numbers that are 1 and three more: one node without a number of blocks and with iblank, or one after it.
TEST(Plot3d, refuses_what_fits_twice) {
  const Form form;
  Writer grid(form), solution(form);
  for (int i = 0; i < 4; i++) grid.integer(1);
  for (int i = 0; i < 3; i++) grid.real(2);
  for (int i = 0; i < 3; i++) solution.integer(1);
  for (int i = 0; i < 9; i++) solution.real(1);
  EXPECT_REFUSED(load(grid.bytes(), solution.bytes()), "2 layouts fit");
}

TEST(Plot3d, real_files) {
  const Plot3d combustor = read_plot3d(data / "combxyz.bin", data / "combq.bin");
  ASSERT_EQ(combustor.blocks.size(), 1u);
  EXPECT_EQ(combustor.blocks[0].size, glm::ivec3(57, 33, 25));
  EXPECT_NE(combustor.layout[0].value.find("big-endian, one block of 57x33x25"), std::string::npos);
  for (const glm::vec3& v : combustor.blocks[0].vectors) ASSERT_TRUE(std::isfinite(v.x + v.y + v.z));

  const Plot3d cylinder = read_plot3d(data / "cylinderxyz.bin", data / "cylinderq.bin");
  ASSERT_EQ(cylinder.blocks.size(), 1u);
  const CurvilinearBlock& block = cylinder.blocks[0];
  EXPECT_EQ(block.size, glm::ivec3(65, 33, 9));
  // Potential flow past the unit cylinder. The file holds floats near 1 to 8, and quotients of them: 4e-6 is some 30
  // roundings of 1.2e-7, which 1/r² and the cosine of an angle of up to 2π spread.
  for (std::size_t i = 0; i < block.points.size(); i++) {
    const glm::dvec3 p = block.points[i];
    const double r2 = p.x * p.x + p.y * p.y, c = (p.x * p.x - p.y * p.y) / r2, s = 2 * p.x * p.y / r2;
    ASSERT_NEAR(block.vectors[i].x, 1 - c / r2, 4e-6);
    ASSERT_NEAR(block.vectors[i].y, -s / r2, 4e-6);
    ASSERT_NEAR(block.vectors[i].z, 0.05, 1e-7);
  }
}

TEST(Plot3d, real_files_cut_short) {
  const std::string grid = get(data / "cylinderxyz.bin");
  const std::string solution = get(data / "cylinderq.bin");
  EXPECT_REFUSED(load(grid.substr(0, grid.size() / 2), solution),
                 "big-endian, one block of 65x33x9 without a number of blocks, no records: 231672 bytes as float32");
  EXPECT_REFUSED(load(grid, solution.substr(0, solution.size() - 1)), "386128 bytes as float32, ");
}

}  // namespace
}  // namespace smurf
