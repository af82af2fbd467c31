// Meshes as a user meets them: the verbs of `smurf` on every device, and bad files of every format, each of which is
// one clear line and exit code 2, or a repair that `info` counts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "harness/command_line.hpp"
#include "harness/density.hpp"
#include "io/png.hpp"
#include "smurf/error.hpp"
#include "truth/meshes.hpp"

namespace smurf {
namespace {

using test::CommandLine;
using test::Csv;
using test::Outcome;
using test::text_of;

// ---- One mesh in every format

// Coordinates are text, so that they can be wrong; corners count from 0.
struct Written {
  std::vector<std::string> vertices;
  std::vector<std::vector<int>> faces;
};

template <class T>
std::string raw(T value, bool big) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big == (std::endian::native == std::endian::little)) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::array<float, 3> numbers_of(const std::string& vertex) {
  std::array<float, 3> p{};
  const char* text = vertex.c_str();
  for (float& x : p) {
    char* end = nullptr;
    x = std::strtof(text, &end);
    text = end;
  }
  return p;
}

std::string raw_vertex(const std::string& vertex, bool big) {
  std::string bytes;
  for (const float x : numbers_of(vertex)) bytes += raw(x, big);
  return bytes;
}

std::string off_of(const Written& mesh) {
  std::string text = fmt::format("OFF\n{} {} 0\n", mesh.vertices.size(), mesh.faces.size());
  for (const auto& v : mesh.vertices) text += v + "\n";
  for (const auto& f : mesh.faces) text += fmt::format("{} {}\n", f.size(), fmt::join(f, " "));
  return text;
}

std::string obj_of(const Written& mesh) {
  std::string text;
  for (const auto& v : mesh.vertices) text += "v " + v + "\n";
  for (const auto& f : mesh.faces) {
    text += "f";
    for (const int corner : f) text += fmt::format(" {}", corner < 0 ? corner : corner + 1);
    text += "\n";
  }
  return text;
}

std::string ply_of(const Written& mesh, const std::string& format) {
  std::string text = fmt::format(
      "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      format, mesh.vertices.size(), mesh.faces.size());
  const bool big = format == "binary_big_endian";
  for (const auto& v : mesh.vertices) text += format == "ascii" ? v + "\n" : raw_vertex(v, big);
  for (const auto& f : mesh.faces) {
    if (format == "ascii") {
      text += fmt::format("{} {}\n", f.size(), fmt::join(f, " "));
    } else {
      text += char(f.size());
      for (const int corner : f) text += raw(corner, big);
    }
  }
  return text;
}

std::string text_stl_of(const Written& mesh) {
  std::string text = "solid test\n";
  for (const auto& f : mesh.faces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int corner : f) text += "vertex " + mesh.vertices.at(std::size_t(corner)) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid test\n";
}

std::string binary_stl_of(const Written& mesh) {
  std::string bytes(80, ' ');
  bytes += raw(std::uint32_t(mesh.faces.size()), false);
  for (const auto& f : mesh.faces) {
    bytes.append(12, '\0');
    for (const int corner : f) bytes += raw_vertex(mesh.vertices.at(std::size_t(corner)), false);
    bytes.append(2, '\0');
  }
  return bytes;
}

struct Format {
  const char* name;  // of the file
  std::string (*write)(const Written&);
  bool has_indices, is_text;
};

const Format formats[] = {
    {"mesh.off", off_of, true, true},
    {"mesh.obj", obj_of, true, true},
    {"text.ply", [](const Written& m) { return ply_of(m, "ascii"); }, true, true},
    {"little.ply", [](const Written& m) { return ply_of(m, "binary_little_endian"); }, true, false},
    {"big.ply", [](const Written& m) { return ply_of(m, "binary_big_endian"); }, true, false},
    {"text.stl", text_stl_of, false, true},
    {"binary.stl", binary_stl_of, false, false},
};

// A pyramid over a square, closed, of triangles.
const Written pyramid = {{"-1 -1 0", "1 -1 0", "1 1 0", "-1 1 0", "0 0 1"},
                         {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}};

class MeshCli : public CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write("pyramid.off", off_of(pyramid));
    describe("pyramid.json", "pyramid.off");
    write("rays.csv", "ox,oy,oz,dx,dy,dz\n0.25,0.1,3,0,0,-2\n5,0,3,0,0,-1\n");
  }

  void describe(const std::string& name, const std::string& mesh, const std::string& more = "") const {
    write(name, R"({"kind": "mesh", "file": ")" + mesh + '"' + more + "}\n");
  }

  // What `info` says of a mesh file.
  Outcome info_of(const std::string& name, const std::string& bytes) const {
    write(name, bytes);
    describe("mesh.json", name);
    return run("info " + in("mesh.json") + " --device reference");
  }

  void expect_info(const std::string& name, const std::string& bytes, const std::vector<std::string>& words) const {
    SCOPED_TRACE(name);
    const Outcome outcome = info_of(name, bytes);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    for (const std::string& word : words)
      EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
  }

  void expect_mesh_refused(const std::string& name, const std::string& bytes, std::vector<std::string> words) const {
    SCOPED_TRACE(name);
    write(name, bytes);
    describe("mesh.json", name);
    words.insert(words.end(), {"\"file\"", name, "mesh.json"});
    expect_refused("info " + in("mesh.json") + " --device reference", words);
  }
};

class MeshCliOnDevice : public MeshCli, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    MeshCli::SetUp();
    if (!test::has_device(GetParam())) GTEST_SKIP() << "no device " << GetParam();
  }
  std::string on_device() const { return std::string(" --device ") + GetParam() + " "; }
};

INSTANTIATE_TEST_SUITE_P(Devices, MeshCliOnDevice, testing::ValuesIn(test::devices_to_try), test::device_name);

// ---- The verbs

TEST_P(MeshCliOnDevice, CastTellsFacesAndWeights) {
  const std::string cast = "cast " + in("pyramid.json") + " --rays " + in("rays.csv");
  const Outcome outcome = run(cast + " --properties normal,parameters" + on_device() + "-o " + in("hits.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const Csv hits(file("hits.csv"));
  EXPECT_EQ(hits.header, "ray,t,status,x,y,z,nx,ny,nz,face,u,v,uncertainty");
  ASSERT_EQ(hits.rows.size(), 2u);
  // The side x + z = 1 first, (1, 2, 4); then the ground. Directions have length 2.
  EXPECT_EQ(hits.number(0, "t"), 1.125f);
  EXPECT_EQ(hits.text(0, "status"), "isolated");
  EXPECT_EQ(hits.number(0, "z"), 0.75f);
  EXPECT_EQ(hits.text(0, "face"), "3");
  EXPECT_NEAR(hits.number(0, "u"), 0.175f, 1e-7);
  EXPECT_NEAR(hits.number(0, "v"), 0.75f, 1e-7);
  EXPECT_NEAR(hits.number(0, "nx"), std::sqrt(0.5f), 1e-6);
  EXPECT_NEAR(hits.number(0, "nz"), std::sqrt(0.5f), 1e-6);
  EXPECT_EQ(hits.number(1, "t"), 1.5f);
  EXPECT_EQ(hits.text(1, "face"), "0");
  EXPECT_EQ(hits.number(1, "nz"), -1.0f);

  ASSERT_EQ(run(cast + " --hits first" + on_device() + "-o " + in("first.csv")).code, 0);
  const Csv first(file("first.csv"));
  ASSERT_EQ(first.rows.size(), 1u);
  EXPECT_EQ(first.number(0, "t"), 1.125f);
  ASSERT_EQ(run(cast + " --properties parameters" + on_device() + "-o " + in("hits.vtp")).code, 0);
  EXPECT_NE(text_of(file("hits.vtp")).find("NumberOfPoints=\"2\""), std::string::npos);
}

TEST_P(MeshCliOnDevice, ProbeTellsTheNearestPoint) {
  write("points.csv", "x,y,z\n2,0.1,2\n0.5,0.25,-3\n");
  const Outcome outcome =
      run("probe " + in("pyramid.json") + " --points " + in("points.csv") + on_device() + "-o " + in("out.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv out(file("out.csv"));
  EXPECT_EQ(out.header, "x,y,z,status,nx,ny,nz,gauss,mean,face,u,v");
  ASSERT_EQ(out.rows.size(), 2u);
  EXPECT_EQ(out.text(0, "face"), "3");  // at (0.5, 0.1, 0.5)
  EXPECT_NEAR(out.number(0, "u"), 0.3f, 1e-6);
  EXPECT_NEAR(out.number(0, "v"), 0.5f, 1e-6);
  EXPECT_EQ(out.text(1, "face"), "0");
  EXPECT_EQ(out.number(1, "nz"), -1.0f);
}

TEST_P(MeshCliOnDevice, CurvatureAndSmoothNormalsOfASphere) {
  const Mesh sphere = test::sphere_mesh(2, 4);
  Written written;
  for (const glm::vec3& v : sphere.vertices()) written.vertices.push_back(fmt::format("{} {} {}", v.x, v.y, v.z));
  for (const glm::uvec3& f : sphere.faces()) written.faces.push_back({int(f.x), int(f.y), int(f.z)});
  write("sphere.ply", ply_of(written, "binary_big_endian"));
  describe("face.json", "sphere.ply");
  describe("smooth.json", "sphere.ply", R"(, "normals": "interpolated")");
  write("rays.csv", "ox,oy,oz,dx,dy,dz\n-5,0.7,0.4,1,0,0\n");
  float off[2];
  for (const bool smooth : {false, true}) {
    const Outcome outcome = run("cast " + in(smooth ? "smooth.json" : "face.json") + " --rays " + in("rays.csv") +
                                " --properties normal,gauss,mean" + on_device() + "-o " + in("hits.csv"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Csv hits(file("hits.csv"));
    ASSERT_EQ(hits.rows.size(), 2u);
    EXPECT_NEAR(hits.number(0, "mean"), 0.5f, 0.005);
    EXPECT_NEAR(hits.number(0, "gauss"), 0.25f, 0.005);
    const glm::vec3 p(hits.number(0, "x"), hits.number(0, "y"), hits.number(0, "z"));
    const glm::vec3 n(hits.number(0, "nx"), hits.number(0, "ny"), hits.number(0, "nz"));
    off[smooth] = glm::length(n - glm::normalize(p));
  }
  EXPECT_LT(off[1], 2e-3f);
  EXPECT_GT(off[0], 5e-3f);
}

TEST_P(MeshCliOnDevice, RenderWritesAPicture) {
  describe("smooth.json", "pyramid.off", R"(, "normals": "interpolated")");
  std::vector<std::vector<std::uint8_t>> pictures;
  for (const std::string what : {"pyramid.json", "smooth.json"}) {
    const Outcome outcome =
        run("render " + in(what) + " --shade phong --size 64x48 --samples 1 --eye 3,-4,2 --look-at 0,0,0.4 --fov 40" +
            on_device() + "-o " + in("image.png"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Image image = load_png(file("image.png"));
    ASSERT_EQ(image.width, 64);
    ASSERT_EQ(image.height, 48);
    EXPECT_FALSE(std::equal(&image.rgba[0], &image.rgba[3], &image.rgba[(24 * 64 + 32) * 4])) << "nothing is seen";
    pictures.emplace_back(image.rgba.begin(), image.rgba.end());
  }
  EXPECT_NE(pictures[0], pictures[1]);
  const std::string curved = "render " + in("pyramid.json") + " --size 32x32 --shade phong,mean" + on_device() + "-o ";
  EXPECT_EQ(run(curved + in("mean.png")).code, 0) << "where curvature is unknown there is a picture, too";
}

TEST_P(MeshCliOnDevice, InfoTellsOfTheMeshAndItsMemory) {
  const Outcome outcome = run("info " + in("pyramid.json") + on_device());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const std::string word : {"mesh", "(-1, -1, 0) to (1, 1, 1)", "triangles", "none on a boundary", "closed",
                                 "outward", "Euler characteristic", "repairs", "none", "face", "device memory"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
}

TEST_F(MeshCli, FilesAreRelativeToTheDescription) {
  std::filesystem::create_directories(file("descriptions"));
  describe("descriptions/up.json", "../pyramid.off");
  describe("absolute.json", file("pyramid.off").string());
  for (const std::string name : {"descriptions/up.json", "absolute.json"}) {
    const Outcome outcome = run("info " + in(name) + " --device reference");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
  }
  describe("descriptions/wrong.json", "pyramid.off");
  expect_refused("info " + in("descriptions/wrong.json"), {"\"file\"", "descriptions/pyramid.off", "No such file"});
}

TEST_F(MeshCli, WeldJoinsVertices) {
  Written apart;
  for (const auto& face : pyramid.faces) {
    const int first = int(apart.vertices.size());
    for (const int corner : face) apart.vertices.push_back(pyramid.vertices[std::size_t(corner)]);
    apart.faces.push_back({first, first + 1, first + 2});
  }
  expect_info("apart.obj", obj_of(apart), {"18 on a boundary", "open"});
  describe("welded.json", "apart.obj", R"(, "weld": true)");
  const Outcome outcome = run("info " + in("welded.json") + " --device reference");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const std::string word : {"none on a boundary", "outward", "13 vertices welded"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
}

TEST_F(MeshCli, RefusesWhatDoesNotSuitMeshes) {
  const std::string cast = "cast " + in("pyramid.json") + " --rays " + in("rays.csv") + " --device reference -o ";
  expect_refused(cast + in("hits.csv") + " --properties value", {"value", "mesh", "level set"});
  expect_refused("compare " + in("pyramid.json") + " --device reference", {"pyramid.json", "mesh", "expression"});
  describe("bad.json", "pyramid.off", R"(, "normals": "smooth")");
  expect_refused("info " + in("bad.json"), {"normals", "smooth", "face, interpolated"});
  describe("bad.json", "pyramid.off", R"(, "weld": "yes")");
  expect_refused("info " + in("bad.json"), {"weld", "true or false", "yes"});
  describe("bad.json", "pyramid.off", R"(, "spatial_splits": 1)");
  expect_refused("info " + in("bad.json"), {"spatial_splits", "true or false", "1"});
  describe("bad.json", "pyramid.off", R"(, "isovalue": 3)");
  expect_refused("info " + in("bad.json"), {"isovalue"});
  write("bad.json", R"({"kind": "mesh"})");
  expect_refused("info " + in("bad.json"), {"\"file\""});
  write("bad.json", R"({"kind": "mesh", "file": 3})");
  expect_refused("info " + in("bad.json"), {"\"file\"", "3"});
}

TEST_F(MeshCli, TheBundledMesh) {
  const Outcome outcome = run("info '" SMURF_SOURCE_DIR "/host/data/elephant.json' --device reference");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const std::string word : {"2775", "5558", "none on a boundary", "outward", "-4", "interpolated"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
}

// ---- Bad files

TEST_F(MeshCli, EveryFormatIsRead) {
  for (const Format& format : formats)
    expect_info(format.name, format.write(pyramid), {"closed", "yes", "outward", "(-1, -1, 0) to (1, 1, 1)"});
}

TEST_F(MeshCli, FilesThatAreMissingOrNoMesh) {
  for (const std::string name : {"missing.off", "missing.obj", "missing.ply", "missing.stl", "missing.fbx"}) {
    describe("mesh.json", name);
    expect_refused("info " + in("mesh.json"), {name, "No such file"});
  }
  describe("mesh.json", ".");
  expect_refused("info " + in("mesh.json"), {"folder"});
  const std::string page = "<!DOCTYPE html>\n<html><head><title>404</title></head></html>\n";
  const std::string picture = std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\1\0", 20) + std::string(200, '\xa7');
  for (const Format& format : formats) {
    expect_mesh_refused(format.name, "", {});
    expect_mesh_refused(format.name, page, {});
    expect_mesh_refused(format.name, picture, {});
    expect_mesh_refused(format.name, std::string(5000, '\0'), {});
  }
  expect_mesh_refused("mesh.off", page, {"line 1", "begins with OFF", "<!DOCTYPE"});
  expect_mesh_refused("mesh.obj", page, {"line 1", "<!DOCTYPE", "no statement of OBJ files"});
  expect_mesh_refused("mesh.ply", page, {"line 1", "begins with \"ply\""});
  expect_mesh_refused("mesh.stl", page, {"begin with \"solid\"", "bytes"});
  expect_mesh_refused("mesh.xyz", "0 0 0\n", {".xyz", ".off, .obj, .ply, .stl"});
}

TEST_F(MeshCli, IndicesOutOfRange) {
  for (const int wrong : {5, 17, -6}) {
    Written mesh = pyramid;
    mesh.faces[4][1] = wrong;
    for (const Format& format : formats) {
      if (!format.has_indices) continue;
      const bool from_one = std::string(format.name) == "mesh.obj";
      const int shown = from_one && wrong >= 0 ? wrong + 1 : wrong;
      // Lines after a header of 2, 0 and 9, and five vertices; binary files have elements.
      const std::string where = std::string(format.name) == "mesh.off"   ? "line 12"
                                : from_one                               ? "line 10"
                                : std::string(format.name) == "text.ply" ? "line 19"
                                                                         : "face 4";
      expect_mesh_refused(format.name, format.write(mesh), {where, fmt::format("vertex {}", shown), "there are 5"});
    }
  }
}

TEST_F(MeshCli, CoordinatesThatAreNotFinite) {
  for (const std::string wrong : {"nan", "-inf", "1e39"}) {
    Written mesh = pyramid;
    mesh.vertices[2] = "1 " + wrong + " 0";
    for (const Format& format : formats)
      expect_mesh_refused(format.name, format.write(mesh),
                          {format.has_indices ? "vertex 2 is (1, " : "vertex 1 is (1, ", "must be finite"});
  }
  Written mesh = pyramid;
  mesh.vertices[2] = "1 one 0";
  for (const Format& format : formats)
    if (format.is_text) expect_mesh_refused(format.name, format.write(mesh), {"line ", "\"one\"", "must be a number"});
}

TEST_F(MeshCli, MeshesWithoutAnything) {
  for (const Format& format : formats) {
    expect_mesh_refused(format.name, format.write({}), {"no vertices"});
    if (format.has_indices)
      expect_mesh_refused(format.name, format.write({pyramid.vertices, {}}), {"5 vertices", "no faces"});
  }
}

TEST_F(MeshCli, FacesOfOneOrTwoVertices) {
  Written mesh = pyramid;
  mesh.faces.insert(mesh.faces.begin() + 1, {{3}, {1, 2}});
  for (const Format& format : formats) {
    if (!format.has_indices) continue;
    expect_info(format.name, format.write(mesh), {"2 faces of one or two corners dropped", "closed", "yes"});
    expect_mesh_refused(format.name, format.write({pyramid.vertices, {{3}, {1, 2}}}),
                        {"no triangle is left of 2 faces", "2 have less than three corners"});
  }
}

TEST_F(MeshCli, TrianglesWithoutArea) {
  Written none = pyramid;
  none.vertices.emplace_back("0.5 0.5 0");  // between 2 and the middle of the ground
  none.vertices.emplace_back("0 0 0");
  none.faces.assign(3000, {0, 5, 2});
  for (std::size_t i = 0; i < none.faces.size(); i += 3) none.faces[i] = {1, 4, 4};
  Written some = none;
  some.faces.insert(some.faces.begin() + 1000, pyramid.faces.begin(), pyramid.faces.end());
  for (const Format& format : formats) {
    expect_mesh_refused(
        format.name, format.write(none),
        {"no triangle is left of 3000 faces", "1000 triangles name a vertex twice", "2000 have zero area"});
    expect_info(format.name, format.write(some),
                {"1000 triangles with a repeated corner dropped", "2000 triangles without area dropped", "outward"});
  }
}

TEST_F(MeshCli, MillionsOfTrianglesWithoutArea) {
  Written mesh = pyramid;
  std::string bytes = ply_of(mesh, "binary_little_endian");
  constexpr std::size_t count = 3'000'000 / test::sanitized_part;
  bytes.replace(bytes.find("element face 6"), 14, fmt::format("element face {}", count + 6));
  std::string triangle(1, '\3');
  for (const int corner : {1, 4, 4}) triangle += raw(corner, false);
  bytes.reserve(bytes.size() + count * triangle.size());
  for (std::size_t i = 0; i < count; i++) bytes += triangle;
  expect_info("many.ply", bytes, {fmt::format("{} triangles with a repeated corner dropped", count), "outward"});
  std::filesystem::remove(file("many.ply"));
}

// Whatever is cut off, formats that say how much there is notice it; of OBJ what is left is a mesh of its own, or none.
TEST_F(MeshCli, FilesThatEndEarly) {
  for (const Format& format : formats) {
    SCOPED_TRACE(format.name);
    const std::string whole = format.write(pyramid);
    const bool tells = std::string(format.name) != "mesh.obj";
    std::size_t refused = 0;
    for (std::size_t size = 0; size + 1 < whole.size(); size++) {
      write(format.name, std::string_view(whole).substr(0, size));
      try {
        const Mesh mesh = load_mesh(file(format.name));
        // The end of a last name or number may be what is missing.
        EXPECT_TRUE(!tells || (size > whole.size() - 8 && mesh.face_count() == 6)) << size << " bytes are accepted";
      } catch (const Error& error) {
        refused++;
        EXPECT_EQ(error.code(), ErrorCode::input);
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
    }
    EXPECT_GT(refused, tells ? whole.size() - 8 : 40);
    expect_mesh_refused(format.name, whole.substr(0, whole.size() / 3), {});
  }
}

// Numbers of elements that no file of this size can have are refused before anything is made for them.
TEST_F(MeshCli, CountsThatLie) {
  for (const std::string count : {"4000000000", "9000000000000000000", "99999999999999999999", "-3", "x"}) {
    const auto put = [&](std::string text, const std::string& old, const std::string& now) {
      const std::size_t at = text.find(old);
      EXPECT_NE(at, text.npos);
      return text.replace(at, old.size(), now);
    };
    expect_mesh_refused("mesh.off", put(off_of(pyramid), "5 6 0", count + " 6 0"),
                        {"line 2", "number of vertices", count});
    expect_mesh_refused("mesh.off", put(off_of(pyramid), "5 6 0", "5 " + count + " 0"),
                        {"line 2", "number of faces", count});
    expect_mesh_refused("mesh.off", put(off_of(pyramid), "3 2 3 4", count + " 2 3 4"), {"line 12", count});
    for (const std::string format : {"ascii", "binary_big_endian"}) {
      for (const std::string element : {"vertex", "face"}) {
        const std::string old = element == "face" ? "face 6" : "vertex 5";
        expect_mesh_refused("mesh.ply", put(ply_of(pyramid, format), old, element + " " + count), {"line ", count});
      }
    }
  }
  for (const std::uint32_t count : {0u, 5u, 7u, 0xffffffffu}) {
    std::string bytes = binary_stl_of(pyramid);
    bytes.replace(80, 4, raw(count, false));
    expect_mesh_refused("mesh.stl", bytes, {fmt::format("of {} triangles it would have", count), "not 384"});
  }
  // A list that is longer than the file.
  std::string list = ply_of(pyramid, "binary_little_endian");
  list.replace(list.find("list uchar"), 10, "list uint ");
  const std::size_t body = list.find("end_header\n") + 11 + 5 * 12;
  list.replace(body, 4, raw(0xfffffff0u, false));
  expect_mesh_refused("list.ply", list, {"face 0", "ends"});
}

TEST_F(MeshCli, LineEndsAndComments) {
  for (const Format& format : formats) {
    if (!format.is_text) continue;
    std::string text = format.write(pyramid), other;
    for (const char c : text) other += c == '\n' ? std::string(" \t\r\n") : std::string(1, c);
    if (std::string(format.name) != "text.stl") expect_info(format.name, other, {"closed", "outward"});
    else expect_info(format.name, other + "\r\n\r\n", {"closed", "outward"});
  }
  expect_info("mesh.off", "# first\nOFF # here\n\n# there\n" + off_of(pyramid).substr(4) + "# last", {"outward"});
  expect_info("mesh.obj", "# first\n\n" + obj_of(pyramid) + "#\n  # last", {"outward"});
  std::string ply = ply_of(pyramid, "binary_big_endian");
  expect_info("mesh.ply", ply.replace(ply.find("element"), 0, "comment \xc3\xa4 face 9\nobj_info x\n"), {"outward"});
}

TEST_F(MeshCli, IndicesOfObjFiles) {
  std::string vertices, faces;
  for (const auto& v : pyramid.vertices) vertices += "v " + v + "\n";
  for (const auto& f : pyramid.faces) faces += fmt::format("f {}/1/1 {}//2 {}\n", f[0] - 5, f[1] - 5, f[2] - 5);
  expect_info("mesh.obj", vertices + faces, {"closed", "outward"});
  // Faces before their vertices, from 1.
  std::string early;
  for (const auto& f : pyramid.faces) early += fmt::format("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
  expect_info("mesh.obj", early + vertices, {"closed", "outward"});
  expect_mesh_refused("mesh.obj", early + "f 1 2 6\n" + vertices, {"line 7", "vertex 6", "there are 5 (from 1)"});
  expect_mesh_refused("mesh.obj", vertices + "f 1 2 0\n", {"line 6", "vertex 0", "from 1"});
  expect_mesh_refused("mesh.obj", faces + vertices, {"line 1", "vertex -5", "there are 0"});
  // A line that goes on counts as the lines that it takes.
  expect_mesh_refused("mesh.obj", vertices + "f 1 \\\n 2 \\\r\n 3\nf 1 2 9\n", {"line 9", "vertex 9"});
}

// A line of `info`, without its name.
std::string fact(const Outcome& outcome, const std::string& name) {
  const std::size_t line = outcome.out.find("\n" + name + " ");
  if (line == std::string::npos) return "nothing";
  const std::size_t begin = outcome.out.find_first_not_of(' ', line + 1 + name.size());
  return outcome.out.substr(begin, outcome.out.find('\n', begin) - begin);
}

// Polygons: quadrilaterals, concave ones, corners on a side, a hole that is cut open, and one that crosses itself.
TEST_F(MeshCli, PolygonsAreSplit) {
  const Written quads = {{"0 0 0", "2 0 0", "2 2 0", "0 2 0", "0 0 2", "2 0 2", "2 2 2", "0 2 2"},
                         {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
  // An L of six corners over z = 0 and 1, and an opening in a square, reached by a cut.
  const Written concave = {
      {"0 0 0", "2 0 0", "2 1 0", "1 1 0", "1 2 0", "0 2 0", "0 0 1", "2 0 1", "2 1 1", "1 1 1", "1 2 1", "0 2 1"},
      {{5, 4, 3, 2, 1, 0},
       {6, 7, 8, 9, 10, 11},
       {0, 1, 7, 6},
       {1, 2, 8, 7},
       {2, 3, 9, 8},
       {3, 4, 10, 9},
       {4, 5, 11, 10},
       {5, 0, 6, 11}}};
  const Written hole = {{"0 0 0", "3 0 0", "3 3 0", "0 3 0", "1 1 0", "1 2 0", "2 2 0", "2 1 0"},
                        {{0, 1, 2, 3, 0, 4, 5, 6, 7, 4}}};
  const Written bow = {{"0 0 0", "1 1 0", "1 0 0", "0 1 0"}, {{0, 1, 2, 3}}};
  for (const Format& format : formats) {
    if (!format.has_indices) continue;
    expect_info(format.name, format.write(quads), {"6 polygons split", "closed", "outward", "24"});
    expect_info(format.name, format.write(concave), {"8 polygons split", "closed", "outward"});
    EXPECT_EQ(fact(info_of(format.name, format.write(concave)), "area"), "14");
    EXPECT_EQ(fact(info_of(format.name, format.write(hole)), "area"), "8");
    EXPECT_EQ(info_of(format.name, format.write(bow)).code, 0);
  }
}

}  // namespace
}  // namespace smurf
