// Descriptions of vector fields on grids, files in their place, and the messages when one is wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <numbers>

#include "flows/definition.hpp"
#include "flows/grid/definition.hpp"
#include "harness/devices.hpp"
#include "harness/files/test_files.hpp"
#include "harness/refusal.hpp"
#include "io/vtk/vtk_files.hpp"
#include "smurf/error.hpp"
#include "smurf/flow.hpp"
#include "smurf/surface.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::put;

const fs::path data = fs::path(SMURF_SOURCE_DIR) / "host/data";

VectorField load(const std::string& description) { return load_vector_field(put("field.json", description)); }

std::string note(const VectorField& field, const std::string& name) {
  for (const Fact& fact : field.model().notes()) {
    if (fact.name == name) return fact.value;
  }
  return "no note " + name;
}

// 2 x 3 x 4 nodes of `components` small numbers as text, at whole places.
std::string nrrd(int components) {
  std::string text =
      "NRRD0005\ntype: float\ndimension: 4\nsizes: " + std::to_string(components) + " 2 3 4\nencoding: ascii\n\n";
  for (int k = 0; k < 4; k++)
    for (int j = 0; j < 3; j++)
      for (int i = 0; i < 2; i++)
        for (int c = 0; c < components; c++) text += std::to_string(c == 0 ? i : c == 1 ? j : k) + " ";
  return text;
}

std::string vtk(const std::string& set, const std::string& geometry, const std::string& arrays = "flow") {
  std::string text = "# vtk DataFile Version 3.0\nmade by a test\nASCII\nDATASET " + set + "\nDIMENSIONS 2 3 4\n" +
                     geometry + "POINT_DATA 24\n";
  if (arrays == "flow") {
    text += "VECTORS flow float\n";
    for (int i = 0; i < 24; i++) text += "1 2 3 ";
  } else {
    text += "SCALARS density float 1\nLOOKUP_TABLE default\n";
    for (int i = 0; i < 24; i++) text += std::to_string(i) + " ";
  }
  return text + "\n";
}

std::string points() {
  std::string text = "POINTS 24 float\n";
  for (int i = 0; i < 24; i++)
    text += std::to_string(i % 2) + " " + std::to_string(i / 2 % 3) + " " + std::to_string(i / 6) + " ";
  return text + "\n";
}

const std::string image = "SPACING 1 1 1\nORIGIN 0 0 0\n";
const std::string axes = "X_COORDINATES 2 float\n0 1\nY_COORDINATES 3 float\n0 1 3\nZ_COORDINATES 4 float\n0 1 3 6\n";

bool has_vtk() {
  if (built_with_vtk()) return true;
  test::report_missing("VTK");
  return false;
}

// ---- Grids

TEST(FlowDescriptions, grids_of_nrrd) {
  put("flow.nrrd", nrrd(3));
  const VectorField field = load(R"({"kind": "grid", "file": "flow.nrrd", "reconstruction": "tricubic"})");
  EXPECT_EQ(field.kind(), "grid");
  EXPECT_EQ(field.bounds().upper, glm::dvec3(1, 2, 3));
  EXPECT_EQ(field.model().smoothness(), 2);
  EXPECT_EQ(load(R"({"kind": "grid", "file": "flow.nrrd"})").model().smoothness(), 0);
  EXPECT_EQ(load(R"({"kind": "stream", "time": [0, 1], "field": {"kind": "grid", "file": "flow.nrrd"},
                     "seed": {"points": [[0, 0, 0], [1, 1, 1]]}})")
                .kind(),
            "grid");
}

TEST(FlowDescriptions, grids_of_vtk) {
  if (!has_vtk()) GTEST_SKIP() << "built without VTK";
  put("flow.vtk", vtk("STRUCTURED_POINTS", image));
  const VectorField field = load(R"({"kind": "grid", "file": "flow.vtk", "array": "flow"})");
  EXPECT_EQ(field.kind(), "grid");
  EXPECT_EQ(note(field, "array"), "\"flow\"");
  EXPECT_EQ(dynamic_cast<const GridFlow&>(field.model()).grid.vectors[23], glm::vec3(1, 2, 3));
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "flow.vtk", "array": "speed"})"), "member \"file\": ");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "flow.vtk", "array": "speed"})"), "its arrays: \"flow\"");
  put("flow.vtk", vtk("STRUCTURED_GRID", points()));
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "flow.vtk"})"),
                 "holds a structured (curvilinear) grid, which \"kind\": \"curvilinear\" reads");
}

TEST(FlowDescriptions, wrong_grids) {
  put("flow.nrrd", nrrd(3));
  put("pair.nrrd", nrrd(2));
  EXPECT_REFUSED(load(R"({"kind": "grid"})"), "member \"file\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": 3})"), "member \"file\" must be a string");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "gone.nrrd"})"), "member \"file\": cannot read");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "pair.nrrd"})"), "2 components a node");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "flow.nrrd", "array": "v"})"), "array \"v\" is asked for");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "flow.nrrd", "reconstruction": "catmull-rom"})"),
                 "known are trilinear, tricubic");
  EXPECT_REFUSED(load(R"({"kind": "grid", "file": "flow.nrrd", "tolerance": 1})"), "unknown member \"tolerance\"");
  EXPECT_REFUSED(load(R"({"kind": "stream", "field": {"kind": "grid", "file": "pair.nrrd"}})"),
                 "member \"field.file\": ");
  EXPECT_REFUSED(load(R"({"kind": "mesh", "file": "bunny.off"})"),
                 "known vector fields: curvilinear, expression, grid");
}

// ---- Curvilinear and rectilinear grids

TEST(FlowDescriptions, plot3d) {
  const VectorField cylinder = load_vector_field(data / "cylinder-flow.json");
  EXPECT_EQ(cylinder.kind(), "curvilinear");
  EXPECT_NE(note(cylinder, "PLOT3D grid").find("big-endian, one block of 65x33x9"), std::string::npos);
  EXPECT_NE(note(cylinder, "PLOT3D solution").find("float32"), std::string::npos);
  EXPECT_NEAR(cylinder.bounds().upper.x, 8, 1e-6);
  EXPECT_EQ(load_vector_field(data / "combustor.json").kind(), "curvilinear");
}

TEST(FlowDescriptions, points_with_vectors) {
  put("grid.nrrd", nrrd(3));
  put("flow.nrrd", nrrd(3));
  const VectorField field = load(R"({"kind": "curvilinear", "points": "grid.nrrd", "vectors": "flow.nrrd",
                                     "reconstruction": "tricubic", "tolerance": 1e-4})");
  EXPECT_EQ(field.kind(), "curvilinear");
  EXPECT_EQ(field.bounds().upper, glm::dvec3(1, 2, 3));
  EXPECT_EQ(field.model().smoothness(), 2);
}

TEST(FlowDescriptions, structured_grids_of_vtk) {
  if (!has_vtk()) GTEST_SKIP() << "built without VTK";
  put("flow.vtk", vtk("STRUCTURED_GRID", points()));
  const VectorField field = load(R"({"kind": "curvilinear", "file": "flow.vtk"})");
  EXPECT_EQ(field.kind(), "curvilinear");
  EXPECT_EQ(field.bounds().upper, glm::dvec3(1, 2, 3));
  EXPECT_EQ(note(field, "array"), "\"flow\"");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "file": "flow.vtk", "solution": "q.bin"})"),
                 "member \"solution\" does not go with \"file\"");
  EXPECT_EQ(load_vector_field(data / "office.vtk").kind(), "curvilinear");
}

TEST(FlowDescriptions, wrong_curvilinear_grids) {
  put("grid.nrrd", nrrd(3));
  put("pair.nrrd", nrrd(2));
  put("grid.xyz", "");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear"})"), "member \"file\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "file": "grid.xyz"})"), "member \"solution\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "file": "grid.xyz", "solution": "grid.xyz"})"),
                 "0 bytes fit no layout");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "points": "grid.nrrd"})"), "member \"vectors\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "vectors": "grid.nrrd"})"), "member \"points\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "points": "grid.nrrd", "vectors": "pair.nrrd"})"), "2 components");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "points": "grid.nrrd", "vectors": "grid.nrrd", "file": "a.vts"})"),
                 "member \"file\" does not go with \"points\"");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "file": "a", "solution": "b", "array": "v"})"),
                 "member \"array\" does not go with \"solution\"");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "points": "grid.nrrd", "vectors": "grid.nrrd", "tolerance": 0})"),
                 "member \"tolerance\" must be positive");
  EXPECT_REFUSED(load(R"({"kind": "stream", "field": {"kind": "curvilinear", "file": "grid.xyz"}})"),
                 "member \"field.solution\" is missing");
}

TEST(FlowDescriptions, rectilinear_grids) {
  put("flow.nrrd", nrrd(3));
  const VectorField field =
      load(R"({"kind": "rectilinear", "axes": [[0, "pi"], [0, 1, 3], [0, 1, 3, 6]], "vectors": "flow.nrrd"})");
  EXPECT_EQ(field.kind(), "rectilinear");
  EXPECT_EQ(field.bounds().upper, glm::dvec3(std::numbers::pi, 3, 6));
  if (!has_vtk()) GTEST_SKIP() << "built without VTK";
  put("flow.vtk", vtk("RECTILINEAR_GRID", axes));
  const VectorField other = load(R"({"kind": "rectilinear", "file": "flow.vtk", "reconstruction": "tricubic"})");
  EXPECT_EQ(other.kind(), "rectilinear");
  EXPECT_EQ(other.bounds().upper, glm::dvec3(1, 3, 6));
  EXPECT_EQ(note(other, "array"), "\"flow\"");
  EXPECT_REFUSED(load(R"({"kind": "curvilinear", "file": "flow.vtk"})"), "\"kind\": \"rectilinear\" reads");
}

TEST(FlowDescriptions, wrong_rectilinear_grids) {
  put("flow.nrrd", nrrd(3));
  const auto with = [](const std::string& list) {
    return R"({"kind": "rectilinear", "vectors": "flow.nrrd", "axes": )" + list + "}";
  };
  EXPECT_REFUSED(load(with("[[0, 1], [0, 1, 2]]")), "member \"axes\" must be three lists");
  EXPECT_REFUSED(load(with("[[0, 1], [0, 1, 2], 7]")), "member \"axes[2]\" must be a list");
  EXPECT_REFUSED(load(with("[[0, 1], [0, true, 2], [0, 1, 2, 3]]")), "member \"axes[1][1]\" must be a number");
  EXPECT_REFUSED(load(with("[[0, 1], [0, 1, 2], [0, 1, 2]]")), "2x3x4 vectors, but the axes have 2x3x3 coordinates");
  EXPECT_REFUSED(load(with("[[0, 1], [0, 2, 1], [0, 1, 2, 3]]")), "member \"vectors\": ");
  EXPECT_REFUSED(load(R"({"kind": "rectilinear", "axes": [[0], [0], [0]]})"), "member \"vectors\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "rectilinear", "vectors": "flow.nrrd"})"), "member \"axes\" is missing");
  EXPECT_REFUSED(load(R"({"kind": "rectilinear", "file": "flow.nrrd"})"), "are read from .vtr and .vtk files");
  EXPECT_REFUSED(load(R"({"kind": "rectilinear", "file": "a.vtr", "axes": []})"),
                 "member \"file\" does not go with \"axes\"");
}

// ---- Files in place of descriptions

TEST(FlowFiles, nrrd_files_hold_vectors_or_scalars) {
  const fs::path vectors = put("flow.nrrd", nrrd(3)), scalars = put("density.nrrd", nrrd(1));
  EXPECT_TRUE(is_vector_field(vectors));
  EXPECT_EQ(load_vector_field(vectors).kind(), "grid");
  EXPECT_FALSE(is_vector_field(scalars));
  EXPECT_REFUSED(load_vector_field(scalars), "1 component a node");
  EXPECT_REFUSED(load_surface(scalars), "needs an isovalue");
  EXPECT_FALSE(is_vector_field(data / "headsq.nhdr"));
  EXPECT_REFUSED(load_surface(data / "headsq.nhdr"), "64x64x93 samples from 0 to 3926");
}

TEST(FlowFiles, vtk_files_hold_vectors_or_scalars) {
  if (!has_vtk()) GTEST_SKIP() << "built without VTK";
  for (const auto& [set, geometry, kind] : {std::array<std::string, 3>{"STRUCTURED_POINTS", image, "grid"},
                                            {"RECTILINEAR_GRID", axes, "rectilinear"},
                                            {"STRUCTURED_GRID", points(), "curvilinear"}}) {
    const fs::path file = put("flow.vtk", vtk(set, geometry));
    EXPECT_TRUE(is_vector_field(file));
    EXPECT_EQ(load_vector_field(file).kind(), kind);
  }
  const fs::path scalars = put("density.vtk", vtk("STRUCTURED_POINTS", image, "density"));
  EXPECT_FALSE(is_vector_field(scalars));
  EXPECT_REFUSED(load_surface(scalars), "needs an isovalue");
  EXPECT_REFUSED(load_vector_field(scalars), "no array of 3 components");
  EXPECT_TRUE(is_vector_field(put("broken.vtk", "broken")));  // so that the reader of vectors says what is wrong
  EXPECT_REFUSED(load_vector_field(put("broken.vtk", "broken")), "broken.vtk\"");
  EXPECT_TRUE(is_vector_field(data / "carotid.vtk"));
  EXPECT_EQ(load_vector_field(data / "carotid.vtk").kind(), "grid");
}

TEST(FlowFiles, isosurfaces_of_vtk_files) {
  if (!has_vtk()) GTEST_SKIP() << "built without VTK";
  put("density.vtk", vtk("STRUCTURED_POINTS", image, "density"));
  const auto surface = [](const std::string& array) {
    return load_surface(put(
        "s.json",
        R"({"kind": "isosurface", "isovalue": 10.5, "field": {"kind": "grid", "file": "density.vtk")" + array + "}}"));
  };
  EXPECT_EQ(surface("").kind(), "isosurface");
  EXPECT_EQ(surface(R"(, "array": "density")").kind(), "isosurface");
  EXPECT_REFUSED(surface(R"(, "array": "pressure")"), "member \"field.file\": ");
  EXPECT_REFUSED(surface(R"(, "array": 7)"), "member \"field.array\" must be a string");
}

TEST(FlowFiles, with_and_without_vtk) {
  EXPECT_TRUE(is_vector_field(data / "carotid.vtk"));
  if (built_with_vtk()) {
    EXPECT_EQ(load_vector_field(data / "carotid.vtk").kind(), "grid");
  } else {
    EXPECT_REFUSED(load_vector_field(data / "carotid.vtk"), "libvtk9-dev");
  }
  EXPECT_EQ(load_vector_field(data / "cylinder-flow.json").kind(), "curvilinear");
}

}  // namespace
}  // namespace smurf
