// Vectors from NRRD files: every type, encoding and byte order; frames; what must be refused.
#include "io/volumes/nrrd_vectors.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>

#include "harness/files/test_files.hpp"
#include "harness/refusal.hpp"
#include "smurf/error.hpp"
#include "smurf/values.hpp"
#include "smurf/volume.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::put;
using test::refusal;
using test::test_folder;

constexpr glm::ivec3 size(3, 2, 4);
constexpr std::size_t nodes = 24;

double component(std::size_t node, int c) { return double((7 * node + 3 * std::size_t(c)) % 50); }

template <class T>
std::string samples(bool big_endian) {
  std::string bytes;
  for (std::size_t i = 0; i < nodes; i++) {
    for (int c = 0; c < 3; c++) {
      const T value = T(component(i, c));
      char raw[sizeof value];
      std::memcpy(raw, &value, sizeof value);
      if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof raw);
      bytes.append(raw, sizeof raw);
    }
  }
  return bytes;
}

std::string header(const std::string& type, const std::string& lines = "", const std::string& sizes = "3 3 2 4") {
  return "NRRD0005\ntype: " + type + "\ndimension: 4\nsizes: " + sizes + "\nencoding: raw\n" + lines;
}

void expect_vectors(const VectorGrid& grid) {
  ASSERT_EQ(grid.size, size);
  ASSERT_EQ(grid.vectors.size(), nodes);
  for (std::size_t i = 0; i < nodes; i++)
    for (int c = 0; c < 3; c++) ASSERT_EQ(grid.vectors[i][c], float(component(i, c)));
}

template <class T>
void check_type(const std::string& name) {
  for (const bool big_endian : {false, true}) {
    const std::string endian = big_endian ? "endian: big\n" : "endian: little\n";
    expect_vectors(read_nrrd_vectors(put("v.nrrd", header(name, endian) + "\n" + samples<T>(big_endian))));
  }
}

TEST(NrrdVectors, every_type) {
  check_type<std::uint8_t>("uint8");
  check_type<std::int8_t>("int8");
  check_type<std::uint16_t>("uint16");
  check_type<std::int16_t>("int16");
  check_type<std::uint32_t>("uint32");
  check_type<std::int32_t>("int32");
  check_type<std::uint64_t>("uint64");
  check_type<std::int64_t>("int64");
  check_type<float>("float");
  check_type<double>("double");
}

TEST(NrrdVectors, text) {
  std::string text;
  for (std::size_t i = 0; i < nodes; i++)
    for (int c = 0; c < 3; c++) text += std::to_string(component(i, c)) + " ";
  expect_vectors(read_nrrd_vectors(
      put("v.nrrd", "NRRD0005\ntype: float\ndimension: 4\nsizes: 3 3 2 4\nencoding: ascii\n\n" + text)));
}

TEST(NrrdVectors, placement_and_kinds) {
  const VectorGrid grid = read_nrrd_vectors(put(
      "v.nrrd", header("float",
                       "endian: little\nkinds: 3-vector domain domain domain\nspace: left-posterior-superior\nspace "
                       "directions: none (1,0,0) (0.5,-2,0) (0,0.25,3)\nspace origin: (-10,20.5,30)\n") +
                    "\n" + samples<float>(false)));
  expect_vectors(grid);
  EXPECT_EQ(grid.placement.axes, glm::dmat3(1, 0, 0, 0.5, -2, 0, 0, 0.25, 3));
  EXPECT_EQ(grid.placement.origin, glm::dvec3(-10, 20.5, 30));
  const VectorGrid spaced =
      read_nrrd_vectors(put("v.nrrd", header("float", "endian: little\nspacings: nan 1 2 0.5\naxis mins: nan 4 5 6\n") +
                                          "\n" + samples<float>(false)));
  EXPECT_EQ(spaced.placement.axes, spacing(1, 2, 0.5).axes);
  EXPECT_EQ(spaced.placement.origin, glm::dvec3(4, 5, 6));
}

// Column c of the frame is the world direction of component c.
TEST(NrrdVectors, measurement_frame) {
  const std::string space =
      "endian: little\nspace dimension: 3\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\nmeasurement frame: ";
  const VectorGrid turned = read_nrrd_vectors(
      put("v.nrrd", header("float", space + "(0,1,0) (-1,0,0) (0,0.5,2)\n") + "\n" + samples<float>(false)));
  ASSERT_EQ(turned.vectors.size(), nodes);
  for (std::size_t i = 0; i < nodes; i++) {
    const float a = float(component(i, 0)), b = float(component(i, 1)), c = float(component(i, 2));
    ASSERT_EQ(turned.vectors[i], glm::vec3(-b, a + 0.5f * c, 2 * c));
  }
  expect_vectors(
      read_nrrd_vectors(put("v.nrrd", header("float", space + "none none none\n") + "\n" + samples<float>(false))));
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", header("float", space + "(0,1,0) (x,0,0) (0,0,1)\n") + "\n")),
                 "is no number");
}

TEST(NrrdVectors, points_with_vectors) {
  const fs::path vectors = put("flow.nrrd", header("float", "endian: little\n") + "\n" + samples<float>(false));
  std::string bytes;
  for (std::size_t i = 0; i < nodes; i++) {
    for (int c = 0; c < 3; c++) {
      const double value = component(i, c) + 1e-12;  // that floats cannot tell
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  }
  const std::string endian = std::endian::native == std::endian::big ? "endian: big\n" : "endian: little\n";
  const fs::path points = put("grid.nrrd", header("double", endian) + "\n" + bytes);
  const CurvilinearBlock block = read_nrrd_block(points, vectors);
  ASSERT_EQ(block.size, size);
  ASSERT_EQ(block.points.size(), nodes);
  EXPECT_TRUE(block.blanked.empty());
  for (std::size_t i = 0; i < nodes; i++) {
    for (int c = 0; c < 3; c++) {
      ASSERT_EQ(block.points[i][c], component(i, c) + 1e-12);
      ASSERT_EQ(block.vectors[i][c], float(component(i, c)));
    }
  }
  const fs::path turned =
      put("turned.nrrd", header("float", "endian: little\n", "3 2 3 4") + "\n" + samples<float>(false));
  EXPECT_REFUSED(read_nrrd_block(points, turned), "2x3x4 vectors");
  EXPECT_REFUSED(read_nrrd_block(points, turned), "3x2x4 points");
}

TEST(NrrdVectors, tells_vectors_from_scalars) {
  EXPECT_TRUE(nrrd_has_vectors(put("v.nrrd", header("uint8") + "\n" + samples<std::uint8_t>(false))));
  EXPECT_FALSE(nrrd_has_vectors(put("v.nrrd", header("uint8", "", "2 3 3 4") + "\n" + samples<std::uint8_t>(false))));
  EXPECT_FALSE(nrrd_has_vectors(fs::path(SMURF_SOURCE_DIR) / "host/data/headsq.nhdr"));
}

TEST(NrrdVectors, refuses_other_numbers_of_components) {
  const std::string bytes = samples<std::uint8_t>(false);
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", header("uint8", "", "2 3 3 4") + "\n" + bytes)),
                 "2 components a node");
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", header("uint8", "", "9 2 2 2") + "\n" + bytes)),
                 "9 components a node");
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", header("uint8", "", "1 6 3 4") + "\n" + bytes)), "1 component a node");
  EXPECT_REFUSED(read_nrrd_vectors(fs::path(SMURF_SOURCE_DIR) / "host/data/headsq.nhdr"), "1 component a node");
  EXPECT_REFUSED(load_volume(put("v.nrrd", header("uint8") + "\n" + bytes)), "3 values along the first axis");
  EXPECT_REFUSED(load_volume(put("v.nrrd", header("uint8") + "\n" + bytes), "flow"), "array \"flow\" is asked for");
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", header("uint8",
                                                        "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1) "
                                                        "(1,1,1)\n") +
                                                     "\n" + bytes)),
                 "space direction");
}

TEST(NrrdVectors, refuses_files_that_are_cut_short) {
  const std::string whole = header("double", "endian: big\nspacings: nan 1 1 1\n") + "\n" + samples<double>(true);
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += 97) {
    const std::string message =
        refusal(ErrorCode::input, [&] { read_nrrd_vectors(put("v.nrrd", whole.substr(0, bytes))); });
    EXPECT_NE(message.find("v.nrrd\""), message.npos) << message;
  }
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", whole.substr(0, whole.size() - 1))), "asks for 576 bytes");
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", whole + 'x')), "asks for 576 bytes");
  EXPECT_REFUSED(read_nrrd_vectors(put("v.nrrd", header("float", "endian: little\n", "2000000000 2 1000 1000") + "\n")),
                 "components");
  EXPECT_REFUSED(read_nrrd_vectors(test_folder() / "missing.nrrd"), "missing.nrrd");
}

#if !defined(__SANITIZE_ADDRESS__)  // there no block is kept
// As any other block of results: what frees it in another way leaves its address known as one that is in use.
TEST(NrrdMemory, IsGivenBackToWhereItIsFrom) {
  constexpr std::size_t bytes = std::size_t(256) * 128 * 160;
  const auto file = put("large.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 256 128 160\nencoding: raw\n\n" +
                                          std::string(bytes, '\x07'));
  const void* before = load_volume(file).samples();
  void* after = allocate_results(bytes);
  EXPECT_EQ(after, before);
  free_results(after);
}
#endif

}  // namespace
}  // namespace smurf
