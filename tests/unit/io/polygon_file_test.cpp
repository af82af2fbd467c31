// Polygons of stream surfaces as files: what was written reads back to the same floats, faces with any number of
// corners among them, and curvature that is not defined.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "harness/files/test_files.hpp"
#include "harness/files/vtk_arrays.hpp"
#include "harness/refusal.hpp"
#include "smurf/mesh.hpp"
#include "smurf/stream_export.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::vtk_array;

// A quadrilateral beside two smaller ones: it has the corner between those, five in all.
MeasuredPolygons three_polygons() {
  MeasuredPolygons mesh;
  mesh.polygons.places = {{0, 0}, {1, 0}, {1, 0.5}, {1, 1}, {0, 1}, {1.25, 0}, {1.25, 0.5}, {1.25, 1}};
  mesh.polygons.offsets = {0, 5, 9, 13};
  mesh.polygons.corners = {0, 1, 2, 3, 4, 1, 5, 6, 2, 2, 6, 7, 3};
  Values<glm::vec3> location, normal;
  Values<float> gauss, mean, k1, k2;
  Values<std::uint32_t> status;
  for (const glm::dvec2& place : mesh.polygons.places) {
    const float u = float(place.x), v = float(place.y);
    location.emplace_back(u, v, 0.1f * u * v);
    normal.push_back(glm::normalize(glm::vec3(-0.1f * v, -0.1f * u, 1)));
    gauss.push_back(-u / 3);
    mean.push_back(u == 1 ? NAN : v / 7);
    k1.push_back(u + 2);
    k2.push_back(v - 2);
    status.push_back(0);
  }
  mesh.points.location = location;
  mesh.points.normal = normal;
  mesh.points.gauss = gauss;
  mesh.points.mean = mean;
  mesh.points.k1 = k1;
  mesh.points.k2 = k2;
  mesh.points.status = status;
  return mesh;
}

bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void expect_same(const std::vector<float>& read, const Column<float>& written, const char* name) {
  ASSERT_EQ(read.size(), written.size()) << name;
  for (std::size_t i = 0; i < read.size(); i++) EXPECT_TRUE(same(read[i], written[i])) << name << " " << i;
}

TEST(PolygonFile, VtkXmlReadsBack) {
  const MeasuredPolygons mesh = three_polygons();
  const fs::path file = test::test_folder() / "three.VTP";
  save_polygons(mesh, file);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file(file.c_str()));
  const pugi::xml_node piece = document.child("VTKFile").child("PolyData").child("Piece");
  EXPECT_EQ(piece.attribute("NumberOfPoints").as_int(), 8);
  EXPECT_EQ(piece.attribute("NumberOfPolys").as_int(), 3);
  const pugi::xml_node data = piece.child("PointData");
  const auto points = vtk_array<glm::vec3>(piece.child("Points"), "Points"),
             normals = vtk_array<glm::vec3>(data, "normal");
  const auto u = vtk_array<float>(data, "u"), tau = vtk_array<float>(data, "tau");
  ASSERT_EQ(points.size(), 8u);
  ASSERT_EQ(normals.size(), 8u);
  ASSERT_EQ(u.size(), 8u);
  ASSERT_EQ(tau.size(), 8u);
  for (std::size_t i = 0; i < 8; i++) {
    EXPECT_EQ(points[i], mesh.points.location[i]);
    EXPECT_EQ(normals[i], mesh.points.normal[i]);
    EXPECT_EQ(u[i], float(mesh.polygons.places[i].x));
    EXPECT_EQ(tau[i], float(mesh.polygons.places[i].y));
  }
  expect_same(vtk_array<float>(data, "gauss"), mesh.points.gauss, "gauss");
  expect_same(vtk_array<float>(data, "mean"), mesh.points.mean, "mean");
  expect_same(vtk_array<float>(data, "k1"), mesh.points.k1, "k1");
  expect_same(vtk_array<float>(data, "k2"), mesh.points.k2, "k2");
  using Numbers = std::vector<std::int64_t>;
  EXPECT_EQ(vtk_array<std::int64_t>(piece.child("Polys"), "connectivity"),
            (Numbers{0, 1, 2, 3, 4, 1, 5, 6, 2, 2, 6, 7, 3}));
  EXPECT_EQ(vtk_array<std::int64_t>(piece.child("Polys"), "offsets"), (Numbers{5, 9, 13}));
}

TEST(PolygonFile, PlyReadsBackByteForByte) {
  const MeasuredPolygons mesh = three_polygons();
  const fs::path file = test::test_folder() / "three.ply";
  save_polygons(mesh, file);
  const std::string text = test::get(file), end = "end_header\n";
  const std::size_t header = text.find(end) + end.size();
  EXPECT_EQ(text.substr(0, header),
            "ply\nformat binary_little_endian 1.0\nelement vertex 8\n"
            "property float x\nproperty float y\nproperty float z\n"
            "property float nx\nproperty float ny\nproperty float nz\n"
            "property float u\nproperty float v\n"
            "property float gauss\nproperty float mean\nproperty float k1\nproperty float k2\n"
            "element face 3\nproperty list uint int vertex_indices\nend_header\n");
  ASSERT_EQ(text.size(), header + 8 * 12 * 4 + (3 + 13) * 4);
  std::vector<float> row(12);
  for (std::size_t i = 0; i < 8; i++) {
    std::memcpy(row.data(), text.data() + header + 48 * i, 48);
    const PointProperties& p = mesh.points;
    const glm::vec3 x = p.location[i], n = p.normal[i];
    const std::vector<float> expected = {x.x,
                                         x.y,
                                         x.z,
                                         n.x,
                                         n.y,
                                         n.z,
                                         float(mesh.polygons.places[i].x),
                                         float(mesh.polygons.places[i].y),
                                         p.gauss[i],
                                         p.mean[i],
                                         p.k1[i],
                                         p.k2[i]};
    for (std::size_t c = 0; c < 12; c++) EXPECT_TRUE(same(row[c], expected[c])) << i << " " << c;
  }
}

// Another program's view of the file: the library's own reader of meshes, which knows nothing of its writer.
TEST(PolygonFile, PlyIsAMesh) {
  const fs::path file = test::test_folder() / "three.ply";
  save_polygons(three_polygons(), file);
  const Mesh mesh = load_mesh(file);
  EXPECT_EQ(mesh.vertex_count(), 8u);
  EXPECT_EQ(mesh.face_count(), 3u + 2 + 2);
  EXPECT_EQ(mesh.repairs().polygons_split, 3u);
  // Neighbours fit: the border is that of the whole, and every triangle is oriented alike.
  EXPECT_EQ(mesh.topology().boundary_edges, 7u);
  EXPECT_TRUE(mesh.topology().manifold);
  EXPECT_EQ(mesh.topology().orientation, MeshOrientation::open);
}

TEST(PolygonFile, RefusesOtherEndings) {
  const std::string message =
      test::refusal(ErrorCode::usage, [] { save_polygons(three_polygons(), test::test_folder() / "three.obj"); });
  EXPECT_NE(message.find(".vtp or .ply"), std::string::npos) << message;
}

TEST(PolygonFile, NothingIsLeftWhereItCannotBeWritten) {
  const fs::path file = test::test_folder() / "missing" / "three.ply";
  test::refusal(ErrorCode::io, [&] { save_polygons(three_polygons(), file); });
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace
}  // namespace smurf
