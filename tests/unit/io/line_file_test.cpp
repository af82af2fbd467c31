// Streamlines as files: rows in order of t, the reason of each end at its row, floats that read back to the same.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <pugixml.hpp>
#include <random>
#include <string>
#include <vector>

#include "harness/command_line.hpp"
#include "harness/files/vtk_arrays.hpp"
#include "io/csv.hpp"
#include "io/writers/line_file.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::text_of;
using test::vtk_array, test::vtk_bytes;

fs::path test_file(const std::string& name) {
  fs::path folder =
      fs::path(SMURF_TEST_OUTPUT) / "lines" / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder / name;
}

void add_line(Streamlines& lines, const std::vector<float>& times, FlowStatus beginning, FlowStatus end) {
  if (lines.offsets.empty()) lines.offsets.push_back(0);
  for (const float t : times) {
    lines.times.push_back(t);
    lines.positions.emplace_back(t, 10 * float(lines.end.size()), 0.1f);
  }
  lines.offsets.push_back(lines.positions.size());
  lines.beginning.push_back(beginning);
  lines.end.push_back(end);
}

// Forward, back as devices store it (from the seed on), both ways, and a seed without a line.
Streamlines four_lines() {
  Streamlines lines;
  add_line(lines, {0, 0.5f, 1}, FlowStatus::inside, FlowStatus::time);
  add_line(lines, {0, -0.5f, -2}, FlowStatus::inside, FlowStatus::domain);
  add_line(lines, {-1, 0, 3}, FlowStatus::stagnation, FlowStatus::steps);
  add_line(lines, {0}, FlowStatus::inside, FlowStatus::blanked);
  return lines;
}

TEST(LineFile, RowsStandInOrderOfTime) {
  const fs::path file = test_file("lines.csv");
  write_lines(four_lines(), file);
  EXPECT_EQ(text_of(file),
            "line,t,status,x,y,z\n"
            "0,0,inside,0,0,0.1\n"
            "0,0.5,inside,0.5,0,0.1\n"
            "0,1,time,1,0,0.1\n"
            "1,-2,domain,-2,10,0.1\n"
            "1,-0.5,inside,-0.5,10,0.1\n"
            "1,0,inside,0,10,0.1\n"
            "2,-1,stagnation,-1,20,0.1\n"
            "2,0,inside,0,20,0.1\n"
            "2,3,steps,3,20,0.1\n"
            "3,0,blanked,0,30,0.1\n");
}

TEST(LineFile, VariationHasColumns) {
  const fs::path file = test_file("lines.csv");
  Streamlines lines;
  add_line(lines, {0, 1}, FlowStatus::inside, FlowStatus::time);
  lines.first = {{1, 2, 3}, {4, 5, 6}};
  write_lines(lines, file);
  EXPECT_EQ(text_of(file), "line,t,status,x,y,z,ux,uy,uz\n0,0,inside,0,0,0.1,1,2,3\n0,1,time,1,0,0.1,4,5,6\n");
  lines.second = {{7, 8, 9}, {-1, NAN, 0}};
  write_lines(lines, file);
  EXPECT_EQ(text_of(file),
            "line,t,status,x,y,z,ux,uy,uz,uux,uuy,uuz\n0,0,inside,0,0,0.1,1,2,3,7,8,9\n"
            "0,1,time,1,0,0.1,4,5,6,-1,nan,0\n");
}

TEST(LineFile, FloatsReadBackToTheSameBits) {
  const fs::path file = test_file("lines.csv");
  std::mt19937 random(4);
  std::uniform_real_distribution<float> exponent(-37, 37), mantissa(-1, 1);
  Streamlines lines;
  std::vector<float> times(5000);
  for (std::size_t i = 0; i < times.size(); i++) times[i] = float(i) / 7;
  add_line(lines, times, FlowStatus::inside, FlowStatus::time);
  for (glm::vec3& p : lines.positions)
    for (int c = 0; c < 3; c++) p[c] = mantissa(random) * std::pow(10.0f, exponent(random));
  write_lines(lines, file);
  const CsvColumns read = read_csv(file, {"t", "x", "y", "z"});
  ASSERT_EQ(read.rows, times.size());
  for (std::size_t i = 0; i < read.rows; i++) {
    ASSERT_EQ(read.columns[0][i], times[i]);
    for (int c = 0; c < 3; c++) ASSERT_EQ(read.columns[std::size_t(c) + 1][i], lines.positions[i][c]) << i;
  }
}

TEST(LineFile, PolylinesAsVtkXml) {
  const fs::path file = test_file("lines.vtp");
  Streamlines lines = four_lines();
  lines.first.assign(lines.positions.size(), glm::vec3(1, 2, 3));
  write_lines(lines, file);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file(file.c_str()));
  const pugi::xml_node piece = document.child("VTKFile").child("PolyData").child("Piece");
  EXPECT_EQ(piece.attribute("NumberOfPoints").as_int(), 10);
  EXPECT_EQ(piece.attribute("NumberOfVerts").as_int(), 1);
  EXPECT_EQ(piece.attribute("NumberOfLines").as_int(), 3);
  const auto points = vtk_array<glm::vec3>(piece.child("Points"), "Points");
  ASSERT_EQ(points.size(), 10u);
  for (std::size_t i = 0; i < points.size(); i++) EXPECT_EQ(points[i], lines.positions[i]);
  EXPECT_EQ(vtk_array<float>(piece.child("PointData"), "t"),
            std::vector<float>(lines.times.begin(), lines.times.end()));
  EXPECT_EQ(vtk_array<glm::vec3>(piece.child("PointData"), "u").size(), 10u);
  const std::string words = vtk_bytes(piece.child("PointData"), "status"), z(1, '\0'), inside = "inside" + z;
  EXPECT_EQ(words, inside + inside + "time" + z + inside + inside + "domain" + z + "stagnation" + z + inside + "steps" +
                       z + "blanked" + z);
  // The vertex stands before the lines, and each line runs in order of t.
  EXPECT_EQ(vtk_array<std::uint32_t>(piece.child("CellData"), "line"), (std::vector<std::uint32_t>{3, 0, 1, 2}));
  EXPECT_EQ(vtk_bytes(piece.child("CellData"), "end"), "blanked" + z + "time" + z + "domain" + z + "steps" + z);
  using Numbers = std::vector<std::int64_t>;
  EXPECT_EQ(vtk_array<std::int64_t>(piece.child("Verts"), "connectivity"), Numbers{9});
  EXPECT_EQ(vtk_array<std::int64_t>(piece.child("Verts"), "offsets"), Numbers{1});
  EXPECT_EQ(vtk_array<std::int64_t>(piece.child("Lines"), "connectivity"), (Numbers{0, 1, 2, 5, 4, 3, 6, 7, 8}));
  EXPECT_EQ(vtk_array<std::int64_t>(piece.child("Lines"), "offsets"), (Numbers{3, 6, 9}));
}

}  // namespace
}  // namespace smurf
