// Mesh files: each format written here by hand, damaged ones, and the meshes of the shared data with their known
// counts.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <random>

#include "harness/density.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/refusal.hpp"
#include "numerics/parallel.hpp"
#include "numerics/text_file.hpp"
#include "reference/mesh/brute_force.hpp"
#include "smurf/mesh.hpp"
#include "truth/trimesh.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::refusal;

fs::path write(const std::string& name, const std::string& bytes) {
  const fs::path folder =
      fs::path(SMURF_TEST_OUTPUT) / "mesh" / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::create_directories(folder);
  const fs::path file = folder / name;
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

Mesh read(const std::string& name, const std::string& bytes, const MeshOptions& options = {}) {
  return load_mesh(write(name, bytes), options);
}

// The message says the file's name and `part`.
void expect_refused(const std::string& name, const std::string& bytes, const std::string& part) {
  const std::string message = refusal(ErrorCode::input, [&] { read(name, bytes); });
  EXPECT_NE(message.find(part), std::string::npos) << "the message was: " << message;
  EXPECT_NE(message.find(name), std::string::npos) << "the message was: " << message;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  return text.replace(at, from.size(), to);
}

// A square pyramid: the ground is one face of four corners.
const std::string off =
    "OFF\n# a pyramid\n5 5 8\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n\n0.5 0.5 1\n4 3 2 1 0\n3 0 1 4\n3 1 2 4 255 0 0\n3 2 3 4\n3 "
    "3 0 4\n";
const std::string obj =
    "# a pyramid\r\nmtllib none.mtl\nv 0 0 0\r\nv 1 0 0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng ground\nf "
    "4//1 3//1 \\\n 2//1 1//1\n"
    "o sides\nv 0.5 0.5 1\nf 1/1/1 2/1/1 5/1/1\nf 2 3 5\ng more\nf -3 -2 -1\nf 4/1 1/1 5/1\n";
const std::string ply =
    "ply\nformat ascii 1.0\ncomment a pyramid\nelement vertex 5\nproperty float x\nproperty double y\nproperty float "
    "z\nproperty uchar red\n"
    "element face 5\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n"
    "0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1 0 255\n0.5 0.5 1 255\n4 3 2 1 0 0.5\n3 0 1 4 0.5\n3 1 2 4 0.5\n3 2 3 4 "
    "0.5\n3 3 0 4 0.5\n";

void expect_pyramid(const Mesh& mesh) {
  ASSERT_EQ(mesh.vertex_count(), 5u);
  ASSERT_EQ(mesh.face_count(), 6u);
  EXPECT_EQ(mesh.vertices()[4], glm::vec3(0.5f, 0.5f, 1));
  EXPECT_EQ(mesh.source_face_count(), 5u);
  EXPECT_EQ(mesh.source_faces()[1], 0u);
  EXPECT_EQ(mesh.source_faces()[5], 4u);
  EXPECT_EQ(mesh.repairs(), MeshRepairs{.polygons_split = 1});
  EXPECT_EQ(mesh.topology().euler_characteristic, 2);
  EXPECT_EQ(mesh.topology().orientation, MeshOrientation::outward);
  EXPECT_NEAR(mesh.topology().volume, 1.0 / 3, 1e-15);
}

template <class T>
std::string raw(T value, bool big) {
  std::string out(reinterpret_cast<const char*>(&value), sizeof value);
  if (big == (std::endian::native == std::endian::little)) std::ranges::reverse(out);
  return out;
}

std::string binary_ply(bool big) {
  std::string out =
      replaced(ply.substr(0, ply.find("0 0 0 255")), "ascii", big ? "binary_big_endian" : "binary_little_endian");
  const float at[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0.5f, 1}};
  for (const auto& p : at) out += raw(p[0], big) + raw(double(p[1]), big) + raw(p[2], big) + '\xff';
  const std::vector<std::vector<int>> faces = {{3, 2, 1, 0}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  for (const auto& face : faces) {
    out += char(face.size());
    for (const int corner : face) out += raw(corner, big);
    out += raw(0.5f, big);
  }
  return out;
}

constexpr float tetrahedron[4][3][3] = {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}},
                                        {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}},
                                        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                        {{0, 1, 0}, {0, 0, 0}, {0, 0, 1}}};

std::string binary_stl() {
  std::string out = "solid: binary files may begin so, too";
  out.resize(80, ' ');
  out += raw(std::uint32_t(4), false);
  for (const auto& triangle : tetrahedron) {
    out.append(12, '\0');
    for (const auto& p : triangle) {
      for (const float value : p) out += raw(value, false);
    }
    out.append(2, '\0');
  }
  return out;
}

std::string text_stl() {
  std::string out = "solid one two\n";
  for (int i = 0; i < 4; i++) {
    if (i == 2) out += "endsolid one two\nSOLID\n";
    out += "  facet normal 0 0 1\n    outer loop\n";
    for (const auto& p : tetrahedron[i]) out += fmt::format("      VERTEX {} {} {:e}\n", p[0], p[1], p[2]);
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid\n";
}

TEST(MeshFile, FormatsKeepTheFilesOwnVerticesAndFaces) {
  expect_pyramid(read("pyramid.off", off));
  expect_pyramid(read("pyramid.OFF", replaced(off, "OFF\n# a pyramid\n5 5 8", "COFF 5 5 0")));
  expect_pyramid(read("pyramid.obj", obj));
  expect_pyramid(read("pyramid.ply", ply));
  expect_pyramid(read("little.ply", binary_ply(false)));
  expect_pyramid(read("big.ply", binary_ply(true)));
}

TEST(MeshFile, StlIsWelded) {
  for (const std::string& bytes : {text_stl(), binary_stl()}) {
    const Mesh mesh = read("tetrahedron.stl", bytes);
    EXPECT_EQ(mesh.vertex_count(), 4u);
    EXPECT_EQ(mesh.face_count(), 4u);
    EXPECT_EQ(mesh.repairs(), MeshRepairs{.welded_vertices = 8});
    EXPECT_EQ(mesh.topology().orientation, MeshOrientation::outward);
  }
}

TEST(MeshFile, EqualVerticesOfAFileStayApartUnlessWelded) {
  const std::string twice = replaced(replaced(off, "5 5 8\n", "6 5 8\n0.5 0.5 1\n"), "4 3 2 1 0\n3 0 1 4\n3 1 2 4",
                                     "4 4 3 2 1\n3 1 2 0\n3 2 3 5");
  const std::string all = replaced(twice, "3 2 3 4\n3 3 0 4", "3 3 4 5\n3 4 1 5");
  EXPECT_EQ(read("twice.off", all).topology().boundary_edges, 4u);
  const Mesh welded = read("twice.off", all, {.weld = true});
  EXPECT_EQ(welded.repairs(), (MeshRepairs{.polygons_split = 1, .welded_vertices = 1}));
  EXPECT_TRUE(welded.topology().closed);
}

TEST(MeshFile, NumbersAreRoundedOnce) {
  // Halfway between two floats but for the last digit, which double cannot tell.
  const Mesh mesh =
      read("digits.off", replaced(off, "0.5 0.5 1\n", "1.00000005960464477539062500000000001 -1e-40 +.5e1\n"));
  EXPECT_EQ(mesh.vertices()[4], glm::vec3(std::nextafter(1.0f, 2.0f), -1e-40f, 5));
}

TEST(MeshFile, PolygonsOfManyCornersAndSmallFaces) {
  std::string text = "OFF\n12 4 0\n", face = "12";
  for (int i = 0; i < 12; i++) {
    text += fmt::format("{} {} 0\n", std::cos(i * 0.5235987755982988), std::sin(i * 0.5235987755982988));
    face += fmt::format(" {}", i);
  }
  const Mesh mesh = read("twelve.off", text + face + "\n2 0 1\n1 3\n0\n");
  EXPECT_EQ(mesh.face_count(), 10u);
  EXPECT_EQ(mesh.repairs(), (MeshRepairs{.polygons_split = 1, .small_faces = 3}));
  EXPECT_NEAR(mesh.topology().area, 3, 1e-6);
  EXPECT_EQ(read("lines.obj", obj + "l 1 2 3\np 1\nf 1 2\n").repairs(),
            (MeshRepairs{.polygons_split = 1, .small_faces = 1, .ignored_elements = 2}));
}

TEST(MeshFile, TriangleStrips) {
  const std::string text =
      replaced(ply.substr(0, ply.find("4 3 2 1 0")),
               "element face 5\nproperty list uchar int vertex_indices\nproperty float quality\n",
               "element edge 1\nproperty int vertex1\nelement tristrips 1\nproperty list int int vertex_indices\n");
  const Mesh mesh = read("strips.ply", text + "7\n12 0 1 4 2 -1 0 4 3 -1 1 0 2\n");
  ASSERT_EQ(mesh.face_count(), 4u);
  EXPECT_EQ(mesh.faces()[0], glm::uvec3(0, 1, 4));
  EXPECT_EQ(mesh.faces()[1], glm::uvec3(1, 2, 4));
  EXPECT_EQ(mesh.faces()[2], glm::uvec3(0, 4, 3));
  EXPECT_EQ(mesh.faces()[3], glm::uvec3(1, 0, 2));
  EXPECT_EQ(mesh.repairs().ignored_elements, 1u);
}

TEST(MeshFile, OtherFormatsComeThroughAssimp) {
  // A scene of one triangle that stands twice, the second time mirrored and moved.
  const std::string scene = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
    "nodes":[{"mesh":0},{"mesh":0,"scale":[-1,1,1],"translation":[0,0,5]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  const Mesh mesh = read("scene.gltf", scene);
  ASSERT_EQ(mesh.face_count(), 2u);
  ASSERT_EQ(mesh.vertex_count(), 6u);
  const ReferenceMesh reference(mesh);
  EXPECT_EQ(reference.face_normal(0), glm::dvec3(0, 0, 1));
  EXPECT_EQ(reference.face_normal(1), glm::dvec3(0, 0, 1)) << "a mirrored triangle is turned";
  EXPECT_EQ(mesh.lower(), glm::vec3(-1, 0, 0));
  EXPECT_EQ(mesh.upper(), glm::vec3(1, 1, 5));
  expect_refused("broken.gltf", "{ this is no scene", "broken.gltf");
  expect_refused("empty.dae", "", "empty.dae");
}

TEST(MeshFile, DamagedFilesAreRefused) {
  EXPECT_NE(refusal(ErrorCode::input, [] { load_mesh("/no/such/mesh.off"); }).find("cannot read \"/no/such/mesh.off\""),
            std::string::npos);
  EXPECT_NE(refusal(ErrorCode::input, [] { load_mesh("/no/such/mesh.fbx"); }).find("cannot read"), std::string::npos);
  EXPECT_NE(refusal(ErrorCode::input, [] { load_mesh(SMURF_TEST_OUTPUT); }).find("it is a folder"), std::string::npos);
  expect_refused("mesh.xyzw", off, "\".xyzw\" is no mesh format that is known");
  expect_refused("mesh", off, "no mesh format");

  for (const char* name : {"empty.off", "empty.obj", "empty.ply", "empty.stl"}) expect_refused(name, "", name);
  for (const char* name : {"words.off", "words.obj", "words.ply", "words.stl"})
    expect_refused(name, "these are words\nand no mesh", name);

  expect_refused("index.off", replaced(off, "3 0 1 4", "3 0 1 17"),
                 "line 11: a face names vertex 17, but there are 5 (0 to 4)");
  expect_refused("index.off", replaced(off, "3 0 1 4", "3 0 1 -1"), "a face names vertex -1");
  expect_refused("index.off", replaced(off, "3 0 1 4", "3 0 1 99999999999999999999"), "out of range");
  expect_refused("index.off", replaced(off, "3 0 1 4", "3 0 1 1.5"),
                 "a corner of a face is \"1.5\"; it must be a whole number");
  expect_refused("short.off", replaced(off, "3 0 1 4", "3 0 1"), "line 11: a corner of a face is missing");
  expect_refused("nan.off", replaced(off, "1 0 0", "nan 0 0"), "vertex 1 is (nan, 0, 0)");
  expect_refused("huge.off", replaced(off, "1 0 0", "1e39 0 0"), "vertex 1 is (inf, 0, 0)");
  expect_refused("word.off", replaced(off, "1 0 0", "1 x 0"), "the y of a vertex is \"x\"; it must be a number");
  expect_refused("flat.off", replaced(off, "1 0 0", "1 0"), "the z of a vertex is missing");
  expect_refused("cut.off", off.substr(0, off.size() - 9), "the file ends after 4 of 5 faces");
  expect_refused("cut.off", off.substr(0, 40), "the file ends after 3 of 5 vertices");
  expect_refused("long.off", off + "3 0 1 2\n", "\"3\" follows after all 5 faces");
  expect_refused("count.off", replaced(off, "5 5 8", "5000000000000 5 8"),
                 "the number of vertices is 5000000000000; the file has");
  expect_refused("count.off", replaced(off, "5 5 8", "-5 5 8"), "the number of vertices is -5");
  expect_refused("four.off", replaced(off, "OFF", "4OFF"), "begins with OFF");
  expect_refused("nothing.off", "OFF\n0 0 0\n", "no vertices");
  expect_refused("points.off", "OFF\n1 0 0\n1 2 3\n", "1 vertices, but no faces");

  expect_refused("index.obj", replaced(obj, "f 2 3 5", "f 2 3 9"), "a face names vertex 9, but there are 5 (from 1)");
  expect_refused("index.obj", replaced(obj, "f 2 3 5", "f 2 3 0"), "");
  expect_refused("index.obj", replaced(obj, "f 2 3 5", "f 2 3 -6"),
                 "a face names vertex -6, but before this line there are 5");
  expect_refused("index.obj", replaced(obj, "f 2 3 5", "f 2 3 /1"), "a corner of a face is missing");
  expect_refused("nan.obj", replaced(obj, "v 1 0 0", "v nan 0 0"), "vertex 1 is (nan, 0, 0)");
  expect_refused("word.obj", replaced(obj, "v 1 0 0", "v x y z"), "line 4: the x of a vertex is \"x\"");
  expect_refused("statement.obj", obj + "face 1 2 3\n", "\"face\" is no statement of OBJ files");

  expect_refused("index.ply", replaced(ply, "3 0 1 4", "3 0 1 5"),
                 "line 19: a corner names vertex 5, but there are 5 (0 to 4)");
  expect_refused("index.ply", replaced(ply, "3 0 1 4", "3 0 1 -1"), "a corner names vertex -1");
  expect_refused("nan.ply", replaced(ply, "1 0 0 255", "nan 0 0 255"), "vertex 1 is (nan, 0, 0)");
  expect_refused("cut.ply", ply.substr(0, ply.size() - 6), "the file ends within \"face\" 4");
  expect_refused("long.ply", ply + "3 0 1 2\n", "\"3\" follows after all elements");
  expect_refused("header.ply", ply.substr(0, ply.find("element face")), "the header has no end");
  expect_refused("format.ply", replaced(ply, "ascii", "utf-8"), "\"utf-8\" is no format of PLY files");
  expect_refused("type.ply", replaced(ply, "property float x", "property quad x"), "\"quad\" is no type of PLY files");
  expect_refused("axis.ply", replaced(ply, "property float z", "property float w"), "the vertices have no x, y and z");
  expect_refused("list.ply", replaced(ply, "vertex_indices", "corners"),
                 "the element \"face\" has no list vertex_indices");
  expect_refused("count.ply", replaced(ply, "element face 5", "element face 99999999"),
                 "99999999 elements \"face\", but the file has");
  expect_refused("cut.ply", binary_ply(false).substr(0, binary_ply(false).size() - 5), "face 4: the file ends here");
  expect_refused("long.ply", binary_ply(true) + "more", "4 bytes follow after all elements");

  expect_refused("cut.stl", binary_stl().substr(0, 200),
                 "as a binary one of 4 triangles it would have 284 bytes, not 200");
  expect_refused("name.stl", replaced(text_stl(), "facet", "face"), "line 2: \"face\" stands where");
  expect_refused("cut.stl", binary_stl().substr(0, 60), "60 bytes are too few for a binary one");
  expect_refused("cut.stl", text_stl().substr(0, text_stl().size() - 20), "the file ends where");
  expect_refused("word.stl", replaced(text_stl(), "VERTEX 0", "VERTEX x"), "a coordinate is \"x\"");
}

// Damage of every kind at random places: a mesh or one clear line, and nothing else.
TEST(MeshFile, RandomDamage) {
  std::mt19937 random(17);
  const auto below = [&](std::size_t count) { return std::size_t(random() % count); };
  const std::vector<std::pair<std::string, std::string>> files = {{"a.off", off},
                                                                  {"a.obj", obj},
                                                                  {"a.ply", ply},
                                                                  {"b.ply", binary_ply(false)},
                                                                  {"c.ply", binary_ply(true)},
                                                                  {"a.stl", text_stl()},
                                                                  {"b.stl", binary_stl()}};
  for (const auto& [name, bytes] : files) {
    int read_anyway = 0;
    for (int i = 0; i < 600; i++) {
      std::string damaged = bytes;
      for (std::size_t k = 0; k <= below(4) && !damaged.empty(); k++) {
        const std::size_t at = below(damaged.size());
        switch (below(4)) {
          case 0:
            damaged[at] = char(random());
            break;
          case 1:
            damaged[at] = "0123456789- .e\n"[below(15)];
            break;
          case 2:
            damaged.erase(at, 1 + below(8));
            break;
          default:
            damaged.insert(at, damaged.substr(below(damaged.size()), 1 + below(12)));
        }
      }
      const fs::path file = write(name, damaged);
      try {
        const Mesh mesh = load_mesh(file);
        EXPECT_GT(mesh.face_count(), 0u);
        read_anyway++;
      } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
    EXPECT_GT(read_anyway, 10) << name;
    EXPECT_LT(read_anyway, 590) << name;
  }
}

// ---- Shared data

using test::shared_data, test::has_shared_data;

struct Known {
  const char* name;
  std::size_t vertices, faces;
  std::int64_t euler;
  std::uint64_t boundary;
  MeshOrientation orientation;
};

const Known shared_meshes[] = {
    {"cgal_elephant.off", 2775, 5558, -4, 0, MeshOrientation::outward},
    {"cgal_ellipe0.003.off", 1556, 3108, 2, 0, MeshOrientation::inward},
    {"cgal_knot2.off", 5760, 11520, 0, 0, MeshOrientation::outward},
    {"cgal_poly2x2+y2-0.0625.off", 1089, 2048, 1, 128, MeshOrientation::open},
    {"cgal_sphere966.off", 926, 1848, 2, 0, MeshOrientation::outward},
    {"libigl_bunny.off", 3485, 6966, 2, 0, MeshOrientation::outward},
    {"spot.obj", 2930, 5856, 2, 0, MeshOrientation::outward},
};

TEST(MeshFile, SharedMeshes) {
  if (!has_shared_data("meshes")) GTEST_SKIP();
  for (const Known& known : shared_meshes) {
    SCOPED_TRACE(known.name);
    const Mesh mesh = load_mesh(shared_data("meshes") / known.name);
    const MeshTopology& t = mesh.topology();
    EXPECT_EQ(mesh.vertex_count(), known.vertices);
    EXPECT_EQ(mesh.face_count(), known.faces);
    EXPECT_EQ(t.euler_characteristic, known.euler);
    EXPECT_EQ(t.boundary_edges, known.boundary);
    EXPECT_EQ(t.orientation, known.orientation);
    EXPECT_TRUE(t.manifold);
  }
}

// Rays of trimesh's tests. The rays are in double, the corners of the OFF file rounded to floats, which moves the sum
// of its t by some 1e-8 of it.
TEST(MeshFile, CrossingsOfTrimeshsRays) {
  if (!has_shared_data("expected")) GTEST_SKIP();
  for (const test::TrimeshCase& known : test::trimesh_cases()) {
    SCOPED_TRACE(known.name);
    const ReferenceMesh reference(load_mesh(known.file));
    std::size_t rays = 0, crossings = 0;
    double sum = 0;
    for (std::size_t i = 0; i < known.origins.size(); i++) {
      const auto hits = reference.hits({known.origins[i], known.directions[i]}, false);
      rays += !hits.empty();
      crossings += hits.size();
      sum += hits.empty() ? 0 : hits[0].t;
    }
    EXPECT_EQ(rays, known.rays_that_hit);
    EXPECT_EQ(crossings, known.crossings);
    EXPECT_NEAR(sum, known.sum_of_nearest_t, known.name == "ballA.off" ? 1e-4 : 1e-8);
    std::cout << known.name << ": " << fmt::format("{:.9f}", sum) << "\n";
  }
}

// Through vertices, along edges, in the planes of faces: on each closed mesh an even number of hits.
TEST(MeshFile, ParityOnSharedMeshes) {
  if (!has_shared_data("meshes")) GTEST_SKIP();
  for (const Known& known : shared_meshes) {
    if (known.boundary != 0) continue;
    SCOPED_TRACE(known.name);
    const Mesh mesh = load_mesh(shared_data("meshes") / known.name);
    const ReferenceMesh reference(mesh);
    const glm::dvec3 middle = 0.5 * (glm::dvec3(mesh.lower()) + glm::dvec3(mesh.upper()));
    const double size = glm::distance(glm::dvec3(mesh.lower()), glm::dvec3(mesh.upper()));
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::atomic<std::size_t> odd = 0, hits = 0;
    const auto cast = [&](const glm::dvec3& origin, const glm::dvec3& direction) {
      const std::size_t count = reference.hits({origin, direction, -infinity, infinity}, false).size();
      odd += count % 2;
      hits += count;
    };
    // Through every vertex along an axis, from outside, and from within outward.
    parallel_for(mesh.vertex_count(), [&](std::size_t i) {
      if (i % test::sanitized_part != 0) return;
      const glm::dvec3 p(mesh.vertices()[i]);
      glm::dvec3 along(0.0);
      along[int(i % 3)] = 1;
      cast(p - 2 * size * along, along);
      cast(p, p - middle);
    });
    // Along an edge of every triangle, and from a corner in its plane.
    parallel_for(mesh.face_count(), [&](std::size_t i) {
      if (i % test::sanitized_part != 0) return;
      const glm::uvec3 f = mesh.faces()[i];
      const int k = int(i % 3);
      const glm::dvec3 a(mesh.vertices()[f[k]]), b(mesh.vertices()[f[(k + 1) % 3]]), c(mesh.vertices()[f[(k + 2) % 3]]);
      i % 2 == 0 ? cast(a, b - a) : cast(a, (b - a) + (c - a));
    });
    EXPECT_EQ(odd, 0u);
    EXPECT_GT(hits, 2 * mesh.vertex_count() / test::sanitized_part);
  }
}

// Curvature in the middles of triangles of meshes whose surface is known.
TEST(MeshFile, CurvatureOnSharedMeshes) {
  if (!has_shared_data("meshes")) GTEST_SKIP();
  {
    const Mesh mesh = load_mesh(shared_data("meshes") / "cgal_sphere966.off");
    const ReferenceMesh reference(mesh);
    double mean = 0, gauss = 0;
    for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
      const SurfaceFrame frame = reference.measure({face, 1.0 / 3, 1.0 / 3}, false);
      mean = std::max(mean, std::abs((frame.k1 + frame.k2) / 2 / 0.1 - 1));
      gauss = std::max(gauss, std::abs(frame.k1 * frame.k2 / 0.01 - 1));
    }
    std::cout << "sphere966: mean off by " << mean << ", gauss by " << gauss << " at most\n";
    EXPECT_LT(mean, 0.02);
    EXPECT_LT(gauss, 0.02);
  }
  const Mesh mesh = load_mesh(shared_data("meshes") / "cgal_poly2x2+y2-0.0625.off");
  const ReferenceMesh reference(mesh);
  double worst_inside = 0, worst_of_all = 0;
  for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
    for (const MeshPoint& point : {MeshPoint{face, 0, 0}, MeshPoint{face, 1, 0}, MeshPoint{face, 0, 1}}) {
      // z = 2x² + y²: H = ((1+z_y²)z_xx + (1+z_x²)z_yy) / 2w³, K = z_xx z_yy / w⁴, w² = 1 + z_x² + z_y²; bends towards
      // a normal that points up.
      const glm::dvec3 p = reference.location(point);
      const double zx = 4 * p.x, zy = 2 * p.y, w = std::sqrt(1 + zx * zx + zy * zy);
      const SurfaceFrame frame = reference.measure(point, false);
      const double up = frame.normal.z > 0 ? -1 : 1;
      const double mean = up * ((1 + zy * zy) * 4 + (1 + zx * zx) * 2) / (2 * w * w * w), gauss = 8 / (w * w * w * w);
      const double error =
          std::max(std::abs((frame.k1 + frame.k2) / 2 - mean) / 3, std::abs(frame.k1 * frame.k2 - gauss) / 8);
      const bool inside = std::max(std::abs(p.x), std::abs(p.y)) < 0.85;
      worst_of_all = std::max(worst_of_all, error);
      if (inside) {
        worst_inside = std::max(worst_inside, error);
        EXPECT_EQ(frame.status & PointStatus::boundary, 0u);
      }
    }
  }
  std::cout << "poly, of the greatest curvature: off by " << worst_inside << " inside, " << worst_of_all
            << " at the border\n";
  EXPECT_LT(worst_inside, 0.01);
}

}  // namespace
}  // namespace smurf
