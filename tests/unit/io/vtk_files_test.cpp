// VTK's files, written here: every kind of grid, text and binary; values of cells, hidden nodes; files cut short.
#include "io/vtk/vtk_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "harness/devices.hpp"
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

const fs::path data = fs::path(SMURF_SOURCE_DIR) / "host/data";

// Skips where smurf was built without VTK. Nothing of VTK's may reach standard error.
class VtkFiles : public testing::Test {
 protected:
  void SetUp() override {
    if (!built_with_vtk()) {
      test::report_missing("VTK");
      GTEST_SKIP() << "built without VTK";
    }
    testing::internal::CaptureStderr();
    captures_ = true;
  }
  void TearDown() override {
    if (captures_) {
      EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    }
  }

 private:
  bool captures_ = false;
};

constexpr glm::ivec3 size(4, 3, 5);
constexpr std::size_t nodes = 60, cells = 24;

double component(std::size_t i, int c) { return double((7 * i + 3 * std::size_t(c)) % 50) / 4 - 3; }
double scalar(std::size_t i) { return double(i) / 2 - 5; }
double coordinate(int axis, int i) { return (axis + 1) * i + 0.25 * i * i; }

// Numbers of a legacy file: text, or big-endian.
std::string numbers(const std::vector<double>& values, bool binary, bool doubles = false) {
  std::string bytes;
  for (const double value : values) {
    if (!binary) {
      bytes += std::to_string(value) + " ";
      continue;
    }
    char raw[8];
    const float small = float(value);
    std::memcpy(raw, doubles ? static_cast<const void*>(&value) : &small, doubles ? 8 : 4);
    if (std::endian::native != std::endian::big) std::reverse(raw, raw + (doubles ? 8 : 4));
    bytes.append(raw, doubles ? 8 : 4);
  }
  return bytes + "\n";
}

std::vector<double> vector_values(std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; i++)
    for (int c = 0; c < 3; c++) values.push_back(component(i, c));
  return values;
}

std::vector<double> scalar_values(std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = 0; i < count; i++) values.push_back(scalar(i));
  return values;
}

std::vector<double> coordinates(int axis) {
  std::vector<double> values;
  for (int i = 0; i < size[axis]; i++) values.push_back(coordinate(axis, i));
  return values;
}

std::vector<double> point_values() {
  std::vector<double> values;
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++)
        for (const double x : {i + 0.25 * k, j + 0.5 * i, k - 0.25 * j}) values.push_back(x);
  return values;
}

std::string legacy(const std::string& set, bool binary) {
  return std::string("# vtk DataFile Version 3.0\nmade by a test\n") + (binary ? "BINARY" : "ASCII") + "\nDATASET " +
         set + "\nDIMENSIONS 4 3 5\n";
}

std::string image_geometry(bool binary) {
  return legacy("STRUCTURED_POINTS", binary) + "SPACING 1 2 0.5\nORIGIN 10 20 -30\n";
}

std::string rectilinear_geometry(bool binary) {
  std::string bytes = legacy("RECTILINEAR_GRID", binary);
  for (int axis = 0; axis < 3; axis++)
    bytes += std::string(1, char('X' + axis)) + "_COORDINATES " + std::to_string(size[axis]) + " double\n" +
             numbers(coordinates(axis), binary, true);
  return bytes;
}

std::string structured_geometry(bool binary) {
  return legacy("STRUCTURED_GRID", binary) + "POINTS 60 float\n" + numbers(point_values(), binary);
}

std::string scalars_and_vectors(bool binary) {
  return "POINT_DATA 60\nSCALARS density float 1\nLOOKUP_TABLE default\n" + numbers(scalar_values(nodes), binary) +
         "VECTORS flow float\n" + numbers(vector_values(nodes), binary);
}

void expect_vectors(const VtkVectors& read) {
  ASSERT_EQ(read.size, size);
  ASSERT_EQ(read.vectors.size(), nodes);
  for (std::size_t i = 0; i < nodes; i++)
    for (int c = 0; c < 3; c++) ASSERT_EQ(read.vectors[i][c], float(component(i, c)));
}

TEST(VtkAbsent, says_what_is_missing) {
  // With VTK, what is missing is the file.
  EXPECT_REFUSED(read_vtk_vectors("flow.vtk", ""), built_with_vtk() ? "flow.vtk" : "libvtk9-dev");
  EXPECT_REFUSED(load_volume("flow.vti"), built_with_vtk() ? "flow.vti" : "SMURF_WITH_VTK");
}

TEST_F(VtkFiles, legacy_images) {
  for (const bool binary : {false, true}) {
    const fs::path file = put("v.vtk", image_geometry(binary) + scalars_and_vectors(binary));
    const VtkVectors read = read_vtk_vectors(file, "");
    expect_vectors(read);
    EXPECT_EQ(read.grid, VtkGrid::image);
    EXPECT_EQ(read.placement.axes, spacing(1, 2, 0.5).axes);
    EXPECT_EQ(read.placement.origin, glm::dvec3(10, 20, -30));
    EXPECT_TRUE(read.blanked.empty());
    ASSERT_EQ(read.notes.size(), 1u);
    EXPECT_EQ(read.notes[0].value, "\"flow\"");
    EXPECT_TRUE(vtk_has_vectors(file));

    const Volume volume = load_volume(file);
    ASSERT_EQ(volume.size(), size);
    EXPECT_EQ(volume.type(), SampleType::float32);
    EXPECT_EQ(volume.placement().origin, glm::dvec3(10, 20, -30));
    for (std::size_t i = 0; i < nodes; i++) ASSERT_EQ(volume.at(i), scalar(i));
  }
}

TEST_F(VtkFiles, legacy_rectilinear_grids) {
  for (const bool binary : {false, true}) {
    const VtkVectors read =
        read_vtk_vectors(put("v.vtk", rectilinear_geometry(binary) + scalars_and_vectors(binary)), "flow");
    expect_vectors(read);
    EXPECT_EQ(read.grid, VtkGrid::rectilinear);
    for (int axis = 0; axis < 3; axis++) EXPECT_EQ(read.axes[std::size_t(axis)], coordinates(axis));
  }
}

TEST_F(VtkFiles, legacy_structured_grids) {
  const std::vector<double> places = point_values();
  for (const bool binary : {false, true}) {
    const VtkVectors read =
        read_vtk_vectors(put("v.vtk", structured_geometry(binary) + scalars_and_vectors(binary)), "");
    expect_vectors(read);
    EXPECT_EQ(read.grid, VtkGrid::structured);
    ASSERT_EQ(read.points.size(), nodes);
    for (std::size_t i = 0; i < nodes; i++)
      for (int c = 0; c < 3; c++) ASSERT_EQ(read.points[i][c], places[3 * i + std::size_t(c)]);
  }
}

// ---- XML

std::string data_array(const std::string& name, int components, const std::vector<double>& values) {
  std::string text = "<DataArray type=\"Float64\" Name=\"" + name + "\" NumberOfComponents=\"" +
                     std::to_string(components) + "\" format=\"ascii\">\n";
  for (const double value : values) text += std::to_string(value) + " ";
  return text + "\n</DataArray>\n";
}

std::string xml(const std::string& type, const std::string& attributes, const std::string& geometry,
                const std::string& point_data, const std::string& cell_data = "",
                const std::string& extent = "0 3 0 2 0 4") {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + type +
         "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<" + type + " WholeExtent=\"" +
         extent + "\"" + attributes + ">\n<Piece Extent=\"" + extent + "\">\n<PointData>\n" + point_data +
         "</PointData>\n<CellData>\n" + cell_data + "</CellData>\n" + geometry + "</Piece>\n</" + type +
         ">\n</VTKFile>\n";
}

std::string xml_arrays() {
  return data_array("density", 1, scalar_values(nodes)) + data_array("flow", 3, vector_values(nodes));
}

std::string points_of_xml() { return "<Points>\n" + data_array("Points", 3, point_values()) + "</Points>\n"; }

TEST_F(VtkFiles, xml_images) {
  // Axes x to y, y to -x; the first node is not that of index 0.
  const std::string attributes = " Origin=\"1 2 3\" Spacing=\"0.5 2 4\" Direction=\"0 -1 0 1 0 0 0 0 1\"";
  const fs::path file = put("v.vti", xml("ImageData", attributes, "", xml_arrays(), "", "2 5 1 3 0 4"));
  const VtkVectors read = read_vtk_vectors(file, "");
  expect_vectors(read);
  EXPECT_EQ(read.grid, VtkGrid::image);
  EXPECT_EQ(read.placement.axes, glm::dmat3(0, 0.5, 0, -2, 0, 0, 0, 0, 4));
  EXPECT_EQ(read.placement.origin, glm::dvec3(1 - 2, 2 + 2 * 0.5, 3));
  const Volume volume = load_volume(file, "density");
  EXPECT_EQ(volume.type(), SampleType::float64);
  EXPECT_EQ(volume.placement().axes, read.placement.axes);
  for (std::size_t i = 0; i < nodes; i++) ASSERT_EQ(volume.at(i), scalar(i));
}

TEST_F(VtkFiles, xml_rectilinear_grids) {
  std::string geometry = "<Coordinates>\n";
  for (int axis = 0; axis < 3; axis++) geometry += data_array(std::string(1, char('x' + axis)), 1, coordinates(axis));
  const VtkVectors read =
      read_vtk_vectors(put("v.vtr", xml("RectilinearGrid", "", geometry + "</Coordinates>\n", xml_arrays())), "");
  expect_vectors(read);
  EXPECT_EQ(read.grid, VtkGrid::rectilinear);
  for (int axis = 0; axis < 3; axis++) EXPECT_EQ(read.axes[std::size_t(axis)], coordinates(axis));
}

TEST_F(VtkFiles, xml_structured_grids) {
  const std::vector<double> places = point_values();
  const VtkVectors read = read_vtk_vectors(put("v.vts", xml("StructuredGrid", "", points_of_xml(), xml_arrays())), "");
  expect_vectors(read);
  EXPECT_EQ(read.grid, VtkGrid::structured);
  ASSERT_EQ(read.points.size(), nodes);
  for (std::size_t i = 0; i < nodes; i++)
    for (int c = 0; c < 3; c++) ASSERT_EQ(read.points[i][c], places[3 * i + std::size_t(c)]);
}

// ---- Values of cells, and what is hidden

// Indices of the cells about a node, by asking every cell for its corners.
std::vector<std::size_t> cells_about(glm::ivec3 node) {
  std::vector<std::size_t> found;
  for (int k = 0; k < size.z - 1; k++)
    for (int j = 0; j < size.y - 1; j++)
      for (int i = 0; i < size.x - 1; i++) {
        const glm::ivec3 corner = node - glm::ivec3(i, j, k);
        if (corner == glm::clamp(corner, glm::ivec3(0), glm::ivec3(1)))
          found.push_back(std::size_t(i + (size.x - 1) * (j + (size.y - 1) * k)));
      }
  return found;
}

glm::ivec3 place_of(std::size_t node) {
  return {int(node) % size.x, int(node) / size.x % size.y, int(node) / (size.x * size.y)};
}

TEST_F(VtkFiles, values_of_cells_come_to_the_nodes) {
  const std::string cell_data =
      data_array("flow", 3, vector_values(cells)) + data_array("heat", 1, scalar_values(cells));
  const fs::path file = put("v.vti", xml("ImageData", " Origin=\"0 0 0\" Spacing=\"1 1 1\"", "", "", cell_data));
  const VtkVectors read = read_vtk_vectors(file, "");
  ASSERT_EQ(read.vectors.size(), nodes);
  ASSERT_FALSE(read.notes.empty());
  EXPECT_NE(read.notes[0].value.find("given for cells"), std::string::npos) << read.notes[0].value;
  const Volume volume = load_volume(file);
  for (std::size_t i = 0; i < nodes; i++) {
    const auto about = cells_about(place_of(i));
    double mean[3] = {0, 0, 0}, heat = 0;
    for (const std::size_t cell : about) {
      for (int c = 0; c < 3; c++) mean[c] += component(cell, c) / double(about.size());
      heat += scalar(cell) / double(about.size());
    }
    // Means of up to eight multiples of a quarter: exact in floats.
    for (int c = 0; c < 3; c++) ASSERT_EQ(read.vectors[i][c], float(mean[c]));
    ASSERT_EQ(volume.at(i), heat);
  }
}

std::string ghosts(std::size_t count, std::size_t marked, int bit) {
  std::string text = "<DataArray type=\"UInt8\" Name=\"vtkGhostType\" format=\"ascii\">\n";
  for (std::size_t i = 0; i < count; i++) text += std::to_string(i == marked ? bit : i % 2) + " ";  // 1: a duplicate
  return text + "\n</DataArray>\n";
}

TEST_F(VtkFiles, hidden_nodes_are_blanked) {
  const VtkVectors read = read_vtk_vectors(
      put("v.vts", xml("StructuredGrid", "", points_of_xml(), xml_arrays() + ghosts(nodes, 17, 2))), "");
  expect_vectors(read);
  ASSERT_EQ(read.blanked.size(), nodes);
  for (std::size_t i = 0; i < nodes; i++) EXPECT_EQ(read.blanked[i] != 0, i == 17) << i;
  const Volume volume = load_volume(
      put("v.vti", xml("ImageData", " Origin=\"0 0 0\" Spacing=\"1 1 1\"", "", xml_arrays() + ghosts(nodes, 17, 2))));
  EXPECT_EQ(volume.non_finite(), 1u);
  EXPECT_TRUE(std::isnan(volume.at(17)));
  EXPECT_EQ(volume.at(18), scalar(18));
}

TEST_F(VtkFiles, corners_of_hidden_cells_are_blanked) {
  const VtkVectors read = read_vtk_vectors(
      put("v.vts", xml("StructuredGrid", "", points_of_xml(), xml_arrays(), ghosts(cells, 7, 32))), "");
  ASSERT_EQ(read.blanked.size(), nodes);
  int count = 0;
  for (std::size_t i = 0; i < nodes; i++) {
    const auto about = cells_about(place_of(i));
    const bool corner = std::ranges::find(about, std::size_t(7)) != about.end();
    EXPECT_EQ(read.blanked[i] != 0, corner) << i;
    count += corner ? 1 : 0;
  }
  EXPECT_EQ(count, 8);
}

// ---- What must be refused

TEST_F(VtkFiles, refuses_arrays_that_are_none) {
  const fs::path file = put("v.vtk", image_geometry(false) + scalars_and_vectors(false));
  EXPECT_REFUSED(read_vtk_vectors(file, "speed"),
                 "no array \"speed\"; its arrays: \"density\" (1 component), \"flow\"");
  EXPECT_REFUSED(read_vtk_vectors(file, "density"), "array \"density\" has 1 component, but 3 are needed");
  EXPECT_REFUSED(load_volume(file, "flow"), "array \"flow\" has 3 components, but 1 is needed");
  const fs::path twice = put("v.vtk", image_geometry(false) + scalars_and_vectors(false) + "VECTORS other float\n" +
                                          numbers(vector_values(nodes), false));
  EXPECT_REFUSED(read_vtk_vectors(twice, ""), "2 arrays of 3 components, name one of them");
  expect_vectors(read_vtk_vectors(twice, "other"));
  const fs::path none = put("v.vtk", image_geometry(false));
  EXPECT_REFUSED(read_vtk_vectors(none, ""), "no array of 3 components; it has no arrays");
  EXPECT_FALSE(vtk_has_vectors(none));
  const fs::path two = put("v.vti", xml("ImageData", " Origin=\"0 0 0\" Spacing=\"1 1 1\"", "",
                                        data_array("pair", 2, std::vector<double>(2 * nodes, 1))));
  EXPECT_REFUSED(read_vtk_vectors(two, ""), "\"pair\" (2 components)");
  EXPECT_REFUSED(read_vtk_vectors(two, "pair"), "array \"pair\" has 2 components, but 3 are needed");
}

TEST_F(VtkFiles, refuses_other_data) {
  EXPECT_REFUSED(read_vtk_vectors(test_folder() / "missing.vtk", ""), "missing.vtk\": No such file");
  EXPECT_REFUSED(read_vtk_vectors(test_folder(), ""), "no regular file");
  EXPECT_REFUSED(read_vtk_vectors(put("v.vtk", ""), ""), "v.vtk\"");
  EXPECT_REFUSED(read_vtk_vectors(put("v.vtk", "solid cube\n"), ""), "v.vtk\"");
  EXPECT_REFUSED(read_vtk_vectors(put("v.vti", "<html></html>\n"), ""), "v.vti\"");
  EXPECT_REFUSED(read_vtk_vectors(put("v.vtk",
                                      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 "
                                      "float\n0 0 0\n"),
                                  ""),
                 "vtkPolyData");
  EXPECT_REFUSED(load_volume(put("v.vtk", structured_geometry(true) + scalars_and_vectors(true))), "vtkStructuredGrid");
  EXPECT_REFUSED(
      read_vtk_vectors(put("v.vtk",
                           "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 1000 "
                           "1000 1000\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 1000000000\nVECTORS v float\n"),
                       ""),
      "cannot be in a file of");
}

// Parts of a file give an error, never a crash, and never vectors that are not all there. Where only the last numbers
// of text are cut, what is left may read as other numbers of the same count: so every part that is read must be whole.
void check_parts(const std::string& name, const std::string& whole, bool& refused_any) {
  for (std::size_t bytes = 0; bytes < whole.size() - 1; bytes += 97) {
    const fs::path file = put(name, whole.substr(0, bytes));
    const std::string message = refusal(ErrorCode::input, [&] { read_vtk_vectors(file, "flow"); });
    EXPECT_NE(message.find(name + "\""), message.npos) << bytes << ": " << message;
    refused_any = true;
  }
}

TEST_F(VtkFiles, refuses_files_that_are_cut_short) {
  for (const bool binary : {false, true}) {
    for (const std::string& geometry :
         {image_geometry(binary), rectilinear_geometry(binary), structured_geometry(binary)}) {
      bool refused = false;
      check_parts("v.vtk", geometry + scalars_and_vectors(binary), refused);
      EXPECT_TRUE(refused);
    }
  }
  bool refused = false;
  check_parts("v.vti", xml("ImageData", " Origin=\"0 0 0\" Spacing=\"1 1 1\"", "", xml_arrays()), refused);
  check_parts("v.vts", xml("StructuredGrid", "", points_of_xml(), xml_arrays()), refused);
  EXPECT_TRUE(refused);
}

// ---- Real files

TEST_F(VtkFiles, carotid) {
  const fs::path file = data / "carotid.vtk";
  const VtkVectors read = read_vtk_vectors(file, "vectors");
  EXPECT_EQ(read.grid, VtkGrid::image);
  EXPECT_EQ(read.size, glm::ivec3(76, 49, 45));
  EXPECT_EQ(read.placement.origin, glm::dvec3(100, 80, 1));
  // The file's bytes, which are big-endian floats at its end.
  const std::string bytes = get(file);
  const std::size_t count = read.vectors.size();
  const auto data = bytes.find('\n', bytes.find("VECTORS vectors float")) + 1;
  ASSERT_EQ(count, 76u * 49u * 45u);
  for (std::size_t i = 0; i < count; i += 997) {
    for (int c = 0; c < 3; c++) {
      std::uint32_t bits = 0;
      for (std::size_t b = 0; b < 4; b++)
        bits = bits << 8 | static_cast<unsigned char>(bytes[data + 12 * i + 4 * std::size_t(c) + b]);
      ASSERT_EQ(read.vectors[i][c], std::bit_cast<float>(bits));
    }
  }
  const Volume volume = load_volume(file);
  EXPECT_EQ(volume.size(), read.size);
  EXPECT_EQ(volume.at(0), 57.0);  // 0x42640000
}

TEST_F(VtkFiles, office) {
  const VtkVectors read = read_vtk_vectors(data / "office.vtk", "");
  EXPECT_EQ(read.grid, VtkGrid::structured);
  EXPECT_EQ(read.size, glm::ivec3(21, 20, 20));
  EXPECT_EQ(read.points.size(), 8400u);
  EXPECT_TRUE(std::ranges::any_of(read.vectors, [](const glm::vec3& v) { return v != glm::vec3(0); }));
}

TEST_F(VtkFiles, real_files_cut_short) {
  const std::string whole = get(data / "office.vtk");
  for (std::size_t part = 1; part < 40; part++)
    EXPECT_REFUSED(read_vtk_vectors(put("v.vtk", whole.substr(0, whole.size() * part / 40 + 1)), ""), "v.vtk\"");
}

}  // namespace
}  // namespace smurf
