// Meshes from arrays: what is refused, what is repaired and counted, and how triangles hang together.
#include "smurf/mesh.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "harness/density.hpp"
#include "harness/refusal.hpp"
#include "kernels/mesh/layout.inc"
#include "meshes/builder.hpp"
#include "surfaces/mesh/hierarchy.hpp"
#include "truth/meshes.hpp"

namespace smurf {
namespace {

using Faces = std::vector<glm::uvec3>;
using Vertices = std::vector<glm::vec3>;

constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();

const Vertices tetrahedron_vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const Faces tetrahedron_faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

MeshRepairs repairs_of(const Vertices& vertices, const Faces& faces, bool weld = false) {
  return make_mesh(vertices, faces, {.weld = weld}).repairs();
}

TEST(Mesh, KeepsWhatItIsGiven) {
  const Mesh mesh = make_mesh(tetrahedron_vertices, tetrahedron_faces);
  ASSERT_EQ(mesh.vertex_count(), 4u);
  ASSERT_EQ(mesh.face_count(), 4u);
  for (std::size_t i = 0; i < 4; i++) {
    EXPECT_EQ(mesh.vertices()[i], tetrahedron_vertices[i]);
    EXPECT_EQ(mesh.faces()[i], tetrahedron_faces[i]);
    EXPECT_EQ(mesh.source_faces()[i], i);
  }
  EXPECT_EQ(mesh.repairs(), MeshRepairs());
  EXPECT_EQ(mesh.lower(), glm::vec3(0));
  EXPECT_EQ(mesh.upper(), glm::vec3(1));
  EXPECT_EQ(mesh.bytes(), 4u * 12 + 4 * 16);
  const Mesh copy = mesh;
  EXPECT_EQ(copy.vertices().data(), mesh.vertices().data());
}

TEST(Mesh, RefusesWhatIsNoMesh) {
  EXPECT_REFUSED(make_mesh(Vertices(), tetrahedron_faces), "no vertices");
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, Faces()), "4 vertices, but no faces");
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, Faces{{0, 1, 2}, {1, 2, 4}}),
                 "face 1 names vertex 4, but there are 4 (0 to 3)");
  for (const float bad : {nan, infinity, -infinity}) {
    Vertices vertices = tetrahedron_vertices;
    vertices[2].y = bad;
    EXPECT_REFUSED(make_mesh(vertices, tetrahedron_faces), "vertex 2 is (0, ");
  }
  const std::vector<std::uint32_t> corners = {0, 1, 2, 3, 1, 9}, sizes = {4, 2}, short_sizes = {4};
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, corners, sizes), "face 1 names vertex 9");
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, corners, short_sizes),
                 "6 corners of faces were given, but the faces have 4");
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, corners, std::span<const std::uint32_t>()), "no sizes");
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, Faces{{0, 1, 1}, {2, 2, 2}}),
                 "no triangle is left of 2 faces: 0 have less than three corners, 2 triangles name a vertex twice");
  const std::vector<std::uint32_t> many(most_corners + 1, 0), one_size = {most_corners + 1};
  EXPECT_REFUSED(make_mesh(tetrahedron_vertices, many, one_size), "16385 corners");
}

TEST(Mesh, DropsAndCountsWhatHasNoArea) {
  Vertices vertices = tetrahedron_vertices;
  vertices.insert(vertices.end(), {{2, 0, 0}, {1, 0, 0}, {7, 7, 7}});
  Faces faces = tetrahedron_faces;
  faces.insert(faces.begin() + 1, {{0, 0, 2}, {0, 1, 4}, {1, 5, 3}});
  const Mesh mesh = make_mesh(vertices, faces);
  EXPECT_EQ(mesh.repairs(), (MeshRepairs{.repeated_corners = 1, .zero_area = 2, .unreferenced_vertices = 3}));
  ASSERT_EQ(mesh.face_count(), 4u);
  EXPECT_EQ(mesh.source_faces()[0], 0u);
  EXPECT_EQ(mesh.source_faces()[1], 4u);
  EXPECT_EQ(mesh.source_face_count(), 7u);
  EXPECT_EQ(mesh.upper(), glm::vec3(1)) << "vertices that belong to no triangle do not widen the box";
  EXPECT_EQ(mesh.vertex_states()[6], vertex_unreferenced);
  EXPECT_EQ(mesh.topology().vertices, 4u);
}

// Points on a line of which no coordinate difference is exact, and the same with one coordinate a single step away.
TEST(Mesh, ZeroAreaIsExact) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> step(-1000, 1000);
  int lines = 0;
  for (int i = 0; i < 20000; i++) {
    const glm::vec3 a(step(random), step(random), step(random)), d(step(random), step(random), step(random));
    const glm::vec3 b = a + 3.0f * d, c = a - 7.0f * d;
    if (b == c) continue;
    const float scale = std::ldexp(1.0f, step(random) / 10), far = std::nextafter(c.z, infinity);
    EXPECT_TRUE(has_no_area(a * scale, b * scale, c * scale));
    lines++;
    const bool along_z = d.x == 0 && d.y == 0;
    if (!along_z) {
      EXPECT_FALSE(has_no_area(a, b, glm::vec3(c.x, c.y, far)));
    }
  }
  EXPECT_GT(lines, 19000);
  const float tiny = std::numeric_limits<float>::denorm_min();
  EXPECT_FALSE(has_no_area({0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}));
  EXPECT_TRUE(has_no_area({0, 0, 0}, {tiny, tiny, 0}, {3e38f, 3e38f, 0}));
  EXPECT_FALSE(has_no_area({0, 0, 0}, {tiny, tiny, 0}, {3e38f, 3e38f, tiny}));
}

TEST(Mesh, WeldsEqualVerticesOnRequest) {
  Vertices vertices;
  Faces faces;
  for (const glm::uvec3& face : tetrahedron_faces) {
    const auto first = std::uint32_t(vertices.size());
    for (int k = 0; k < 3; k++) vertices.push_back(tetrahedron_vertices[face[k]] + glm::vec3(k == 1 ? -0.0f : 0.0f));
    faces.emplace_back(first, first + 1, first + 2);
  }
  const Mesh apart = make_mesh(vertices, faces), welded = make_mesh(vertices, faces, {.weld = true});
  EXPECT_EQ(apart.vertex_count(), 12u);
  EXPECT_EQ(apart.topology().components, 4u);
  EXPECT_FALSE(apart.topology().closed);
  EXPECT_EQ(welded.vertex_count(), 4u);
  EXPECT_EQ(welded.repairs(), MeshRepairs{.welded_vertices = 8});
  EXPECT_TRUE(welded.topology().closed);
  EXPECT_EQ(welded.topology().euler_characteristic, 2);
  // What is joined may leave triangles without area.
  EXPECT_EQ(repairs_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}}, {{0, 1, 2}, {0, 1, 3}}, true),
            (MeshRepairs{.repeated_corners = 1, .welded_vertices = 1}));
}

// The area of what a polygon is split into, the count of triangles, and that none is turned over.
void expect_split(const std::vector<glm::dvec3>& corners, double area) {
  std::vector<glm::uvec3> triangles;
  split_polygon(corners, triangles);
  ASSERT_EQ(triangles.size(), corners.size() - 2);
  glm::dvec3 whole(0.0);
  double parts = 0;
  for (const glm::uvec3& t : triangles) {
    const glm::dvec3 part = 0.5 * glm::cross(corners[t.y] - corners[t.x], corners[t.z] - corners[t.x]);
    whole += part;
    parts += glm::length(part);
  }
  EXPECT_NEAR(glm::length(whole), area, 1e-12);
  EXPECT_NEAR(parts, area, 1e-12);
}

TEST(Mesh, SplitsPolygons) {
  expect_split({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, 2);
  expect_split({{0, 0, 0}, {0, 2, 0}, {0, 2, 1}, {0, 0, 1}}, 2);
  expect_split({{0, 0, 1}, {2, 0, 1}, {0.5, 0.5, 1}, {0, 2, 1}}, 1);  // a dart, reflex at 2
  expect_split({{0.5, 0.5, 1}, {0, 2, 1}, {0, 0, 1}, {2, 0, 1}}, 1);  // reflex at 0
  expect_split({{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {2, 3, 0}, {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}}, 7);  // a U
  expect_split({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}},
               2);  // a corner on a straight side: no triangle without area
  std::vector<glm::dvec3> star;
  for (int i = 0; i < 64; i++) {
    const double r = i % 2 == 0 ? 1 : 0.3, angle = 2 * 3.14159265358979324 * i / 64;
    star.emplace_back(r * std::cos(angle), 0.5, r * std::sin(angle));
  }
  expect_split(star, 32 * 0.3 * std::sin(3.14159265358979324 / 32));

  const std::vector<std::uint32_t> corners = {0, 1, 2, 3, 0, 1, 3, 2}, sizes = {4, 2, 1, 1};
  const Mesh mesh = make_mesh(Vertices{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, corners, sizes);
  EXPECT_EQ(mesh.repairs(), (MeshRepairs{.polygons_split = 1, .small_faces = 3}));
  EXPECT_EQ(mesh.face_count(), 2u);
  EXPECT_EQ(mesh.source_faces()[1], 0u);
}

TEST(Mesh, TopologyOfClosedSurfaces) {
  const MeshTopology t = make_mesh(tetrahedron_vertices, tetrahedron_faces).topology();
  EXPECT_EQ(t.vertices, 4u);
  EXPECT_EQ(t.edges, 6u);
  EXPECT_EQ(t.faces, 4u);
  EXPECT_EQ(t.euler_characteristic, 2);
  EXPECT_EQ(t.components, 1u);
  EXPECT_TRUE(t.closed && t.manifold);
  EXPECT_EQ(t.orientation, MeshOrientation::outward);
  EXPECT_NEAR(t.volume, 1.0 / 6, 1e-15);
  EXPECT_NEAR(t.area, 1.5 + std::sqrt(3.0) / 2, 1e-15);

  Faces turned = tetrahedron_faces;
  for (glm::uvec3& face : turned) std::swap(face.x, face.y);
  EXPECT_EQ(make_mesh(tetrahedron_vertices, turned).topology().orientation, MeshOrientation::inward);
  std::swap(turned[0].x, turned[0].y);
  const MeshTopology mixed = make_mesh(tetrahedron_vertices, turned).topology();
  EXPECT_EQ(mixed.orientation, MeshOrientation::mixed);
  EXPECT_EQ(mixed.inconsistent_edges, 3u);
  EXPECT_TRUE(mixed.closed && mixed.manifold);

  const MeshTopology sheet = make_mesh(tetrahedron_vertices, Faces{{0, 1, 2}, {0, 2, 1}}).topology();
  EXPECT_TRUE(sheet.closed);
  EXPECT_EQ(sheet.orientation, MeshOrientation::flat);

  const MeshTopology torus = test::torus_mesh(3, 1, 40, 20).topology();
  EXPECT_EQ(torus.euler_characteristic, 0);
  EXPECT_EQ(torus.edges, 3u * 800);
  EXPECT_TRUE(torus.closed && torus.manifold);
  EXPECT_EQ(torus.orientation, MeshOrientation::outward);
}

TEST(Mesh, TopologyOfOpenAndNonManifoldSurfaces) {
  const MeshTopology open = make_mesh(tetrahedron_vertices, Faces{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}}).topology();
  EXPECT_EQ(open.boundary_edges, 3u);
  EXPECT_FALSE(open.closed);
  EXPECT_TRUE(open.manifold);
  EXPECT_EQ(open.orientation, MeshOrientation::open);
  EXPECT_EQ(open.volume, 0);

  // Three triangles on one edge.
  const Vertices book = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}};
  const Mesh pages = make_mesh(book, Faces{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  EXPECT_EQ(pages.topology().non_manifold_edges, 1u);
  EXPECT_EQ(pages.topology().non_manifold_vertices, 2u);
  EXPECT_EQ(pages.topology().inconsistent_edges, 0u);
  EXPECT_FALSE(pages.topology().manifold);
  EXPECT_FALSE(pages.topology().closed);
  EXPECT_EQ(pages.vertex_states()[0], vertex_boundary | vertex_non_manifold);
  EXPECT_EQ(pages.vertex_states()[4], vertex_boundary);
  EXPECT_EQ(make_mesh(book, Faces{{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}).topology().inconsistent_edges, 1u);

  // Two tetrahedra that share a vertex only.
  Vertices two = tetrahedron_vertices;
  two.insert(two.end(), {{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}});
  Faces faces = tetrahedron_faces;
  faces.insert(faces.end(), {{0, 4, 5}, {0, 6, 4}, {4, 6, 5}, {5, 6, 0}});
  const Mesh touching = make_mesh(two, faces);
  EXPECT_EQ(touching.topology().non_manifold_vertices, 1u);
  EXPECT_EQ(touching.topology().non_manifold_edges, 0u);
  EXPECT_EQ(touching.vertex_states()[0], vertex_non_manifold);
  EXPECT_TRUE(touching.topology().closed);
  EXPECT_EQ(touching.topology().components, 1u);
  EXPECT_EQ(touching.topology().euler_characteristic, 3);

  // A band with half a turn has no orientation.
  Vertices band;
  Faces strip;
  constexpr std::uint32_t n = 12;
  for (std::uint32_t i = 0; i < n; i++) {
    const float a = 6.2831853f * float(i) / n;
    for (const float w : {-0.3f, 0.3f})
      band.emplace_back((2 + w * std::cos(a / 2)) * std::cos(a), (2 + w * std::cos(a / 2)) * std::sin(a),
                        w * std::sin(a / 2));
    const std::uint32_t next = i + 1 < n ? 2 * i + 2 : 1, other = i + 1 < n ? 2 * i + 3 : 0;
    strip.insert(strip.end(), {{2 * i, next, 2 * i + 1}, {2 * i + 1, next, other}});
  }
  const MeshTopology moebius = make_mesh(band, strip).topology();
  EXPECT_EQ(moebius.euler_characteristic, 0);
  EXPECT_EQ(moebius.boundary_edges, 2 * n);
  EXPECT_EQ(moebius.inconsistent_edges, 1u);
  EXPECT_TRUE(moebius.manifold);
  EXPECT_EQ(moebius.orientation, MeshOrientation::mixed);
}

TEST(Mesh, TenMillionTrianglesWithoutArea) {
  Vertices vertices = tetrahedron_vertices;
  vertices.emplace_back(0.0f, 0.1f, 0.2f);
  vertices.emplace_back(0.0f, 0.2f, 0.4f);
  Faces faces(10'000'000 / test::sanitized_part, {0, 1, 1});
  for (std::size_t i = 0; i < faces.size(); i += 2) faces[i] = {0, 4, 5};
  const std::size_t half = faces.size() / 2;
  EXPECT_REFUSED(make_mesh(vertices, faces),
                 fmt::format("{0} triangles name a vertex twice, {0} have zero area", half));
  faces[4711] = {0, 1, 2};
  const Mesh mesh = make_mesh(vertices, faces, {.weld = true});
  EXPECT_EQ(mesh.face_count(), 1u);
  EXPECT_EQ(mesh.source_faces()[0], 4711u);
  EXPECT_EQ(mesh.repairs(), (MeshRepairs{.repeated_corners = half - 1, .zero_area = half, .unreferenced_vertices = 3}));
}

TEST(Mesh, TenMillionTriangles) {
  const Mesh mesh = test::torus_mesh(3, 1, 2500 / test::sanitized_part, 2000);
  EXPECT_EQ(mesh.face_count(), 10'000'000u / test::sanitized_part);
  EXPECT_EQ(mesh.topology().euler_characteristic, 0);
  EXPECT_EQ(mesh.topology().edges, 15'000'000u / test::sanitized_part);
  EXPECT_TRUE(mesh.topology().closed && mesh.topology().manifold);
  EXPECT_EQ(make_mesh(mesh.vertices(), mesh.faces(), {.weld = true}).vertex_count(), mesh.vertex_count());
}

// Progress only grows, is told one call at a time, and what it throws ends the work.
TEST(Mesh, HierarchyTellsItsProgress) {
  const Mesh mesh = test::torus_mesh(3, 1, 400, 300);
  std::size_t calls = 0, last = 0;
  std::atomic<int> inside = 0;
  const MeshHierarchy hierarchy = build_hierarchy(mesh, 1, false, [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(++inside, 1);
    EXPECT_EQ(total, mesh.face_count());
    EXPECT_GE(done, last);
    EXPECT_LE(done, total);
    last = done;
    calls++;
    inside--;
  });
  EXPECT_GT(calls, 10u);
  EXPECT_GT(last, mesh.face_count() / 2);
  EXPECT_GT(hierarchy.nodes.size(), 1000u);

  struct Enough {};
  calls = 0;
  EXPECT_THROW(build_hierarchy(mesh, 1, false,
                               [&](std::size_t, std::size_t) {
                                 if (++calls == 3) throw Enough();
                               }),
               Enough);
  EXPECT_EQ(calls, 3u);
  EXPECT_EQ(build_hierarchy(mesh, 1).triangles, hierarchy.triangles) << "and the next is built";
}

// Which faces stand in the leaves, and in how many. Leaves follow each other (kernels/mesh/layout.inc).
std::vector<int> leaves_of_faces(const Mesh& mesh, const MeshHierarchy& hierarchy) {
  std::vector<int> leaves(mesh.face_count());
  const std::vector<std::uint32_t>& words = hierarchy.triangles;
  for (std::size_t at = 0; at < words.size() && words[at] != 0;) {
    const std::size_t vertices = words[at] % MESH_LEAF_COUNT, count = words[at] / MESH_LEAF_COUNT;
    const std::size_t first = at + 1 + count + 3 * vertices;
    for (std::size_t i = 0; i < count; i++) leaves[words[first + i]]++;
    at = (first + count + MESH_LEAF_WORDS - 1) / MESH_LEAF_WORDS * MESH_LEAF_WORDS;
  }
  return leaves;
}

TEST(Mesh, SpatialSplitsPutATriangleIntoSeveralLeaves) {
  const Mesh mesh = test::slanted_strips(600);
  const std::vector<int> plain = leaves_of_faces(mesh, build_hierarchy(mesh, 1)),
                         split = leaves_of_faces(mesh, build_hierarchy(mesh, 1, true));
  EXPECT_TRUE(std::ranges::all_of(plain, [](int leaves) { return leaves == 1; }));
  EXPECT_TRUE(std::ranges::all_of(split, [](int leaves) { return leaves >= 1; }));
  EXPECT_GT(std::accumulate(split.begin(), split.end(), 0), 900);
}

// Polygons of as many corners as are taken: some that offer no ear for long.
TEST(Mesh, PolygonsOfManyCorners) {
  constexpr std::uint32_t corners = most_corners / test::sanitized_part;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<glm::dvec3> scribble, comb, spiral;
  for (std::uint32_t i = 0; i < corners; i++) {
    scribble.emplace_back(uniform(random), uniform(random), 0);
    comb.emplace_back(i, i % 2 == 0 ? 0 : 1 + 0.001 * i, 0);
    // In along one arm, out along another beside it.
    const bool in = i < corners / 2;
    const double angle = 0.01 * (in ? i : corners - i), r = angle + (in ? 0.0 : 1.0);
    spiral.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
  }
  for (const auto& polygon : {scribble, comb, spiral}) {
    std::vector<glm::uvec3> triangles;
    split_polygon(polygon, triangles);
    EXPECT_EQ(triangles.size(), corners - 2);
  }
}

}  // namespace
}  // namespace smurf
