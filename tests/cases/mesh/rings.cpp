// The rings of a mesh's vertices as the device makes them, on every device, against a search through all triangles.
//
// Of each vertex: its fans are its triangles, each once and in order, and the points of its fit are its neighbours and
// theirs, where these are neither too few nor too many; a neighbour's neighbour may stand there twice.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "device/executor.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "kernels/mesh/layout.inc"
#include "surfaces/mesh/vertices.hpp"
#include "truth/meshes.hpp"

KERNELS(mesh_fans, mesh_ring_sizes, mesh_rings);

namespace smurf::test {
namespace {

using Triangle = std::array<std::uint32_t, 3>;  // a vertex and the other two corners, in order

constexpr std::size_t fewest_points = 12, most_points = 64;  // host/surfaces/mesh/rings.cpp
constexpr std::size_t hub = 32;                              // neighbours of a vertex that leads no further

struct Ring {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> points;
};

std::vector<Ring> read_rings(Executor& executor, const Mesh& mesh) {
  const MeshRingTables tables = make_rings(executor, mesh, mesh_unit(mesh));
  const std::size_t count = mesh.vertex_count();
  std::vector<std::uint32_t> words(tables.planned.ring_words);
  tables.rings.read(words);
  std::vector<Ring> rings(count);
  std::vector<int> seen(count);
  for (std::size_t place = 0; place < count; place++) {
    const std::uint32_t* head = words.data() + words[place / MESH_SLICE] + place % MESH_SLICE;
    const std::uint32_t fan = head[0], points = head[MESH_SLICE], end = head[2 * MESH_SLICE],
                        vertex = head[3 * MESH_SLICE];
    EXPECT_LT(vertex, count);
    if (vertex >= count) continue;
    seen[vertex]++;
    Ring& ring = rings[vertex];
    std::uint32_t last = 0;
    for (std::uint32_t i = 0; i < end; i++) {
      const std::uint32_t entry = head[(MESH_RING_HEAD + i) * MESH_SLICE], number = entry / 4;
      EXPECT_LT(number, count) << "vertex " << vertex << ", entry " << i;
      if (i < fan && entry % 4 == 0) ring.triangles.push_back({vertex, last, number});
      if (i >= points) ring.points.push_back(number);
      last = number;
    }
  }
  for (std::size_t v = 0; v < count; v++) EXPECT_EQ(seen[v], 1) << "vertex " << v;
  return rings;
}

void check(const Mesh& mesh, const std::string& name) {
  SCOPED_TRACE(name);
  const std::size_t count = mesh.vertex_count();
  std::vector<std::vector<Triangle>> triangles(count);
  std::vector<std::set<std::uint32_t>> neighbours(count);
  for (const glm::uvec3& f : mesh.faces()) {
    for (const Triangle& t : {Triangle{f.x, f.y, f.z}, Triangle{f.y, f.z, f.x}, Triangle{f.z, f.x, f.y}}) {
      triangles[t[0]].push_back(t);
      neighbours[t[0]].insert({t[1], t[2]});
    }
  }
  for (const TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    Device opened = device.device;
    std::vector<Ring> rings = read_rings(opened.executor(), mesh);
    int failures = 0;
    for (std::uint32_t v = 0; v < count && failures < 5; v++) {
      Ring& ring = rings[v];
      std::ranges::sort(ring.triangles);
      std::ranges::sort(triangles[v]);
      EXPECT_EQ(ring.triangles, triangles[v]) << "vertex " << v, failures += ring.triangles != triangles[v];

      const std::set<std::uint32_t> points(ring.points.begin(), ring.points.end());
      std::set<std::uint32_t> expected = neighbours[v];
      bool by_a_hub = false;
      for (const std::uint32_t neighbour : neighbours[v]) {
        by_a_hub |= triangles[neighbour].size() > hub;
        expected.insert(neighbours[neighbour].begin(), neighbours[neighbour].end());
      }
      expected.erase(v);
      const bool is_first_ring_there = std::ranges::includes(points, neighbours[v]);
      EXPECT_TRUE(is_first_ring_there) << "vertex " << v;
      EXPECT_FALSE(points.contains(v)) << "vertex " << v;
      failures += !is_first_ring_there || points.contains(v);
      if (by_a_hub || expected.size() + 1 < fewest_points || expected.size() > most_points) continue;
      EXPECT_EQ(points, expected) << "vertex " << v;
      failures += points != expected;
    }
  }
}

Mesh with_faces(const Mesh& mesh, const std::function<void(std::vector<glm::uvec3>&)>& change) {
  std::vector<glm::uvec3> faces(mesh.faces().begin(), mesh.faces().end());
  change(faces);
  return make_mesh(mesh.vertices(), faces);
}

TEST(MeshRings, ClosedSurfaces) {
  check(sphere_mesh(1, 0), "octahedron");
  check(sphere_mesh(1, 1), "sphere of 32 triangles");
  check(sphere_mesh(1, 4), "sphere of 2,048 triangles");
  check(torus_mesh(2, 0.5, 40, 17), "torus");
  check(torus_mesh(2, 0.1, 60, 3), "torus of three across");
  check(torus_mesh(2, 0.1, 60, 4), "torus of four across");
  check(box_mesh(glm::vec3(0), glm::vec3(1), 7), "box");
}

// Triangles in any order, numbered in any order.
TEST(MeshRings, InAnyOrder) {
  const Mesh torus = torus_mesh(2, 0.5, 40, 17);
  std::mt19937 random(7);
  std::vector<std::uint32_t> number(torus.vertex_count());
  for (std::uint32_t v = 0; v < number.size(); v++) number[v] = v;
  std::ranges::shuffle(number, random);
  std::vector<glm::vec3> vertices(number.size());
  for (std::size_t v = 0; v < number.size(); v++) vertices[number[v]] = torus.vertices()[v];
  std::vector<glm::uvec3> faces;
  for (const glm::uvec3& f : torus.faces()) {
    const glm::uvec3 named(number[f.x], number[f.y], number[f.z]);
    const auto turn = random() % 3;
    faces.push_back(turn == 0   ? named
                    : turn == 1 ? glm::uvec3(named.y, named.z, named.x)
                                : glm::uvec3(named.z, named.x, named.y));
  }
  std::ranges::shuffle(faces, random);
  check(make_mesh(vertices, faces), "shuffled torus");
}

TEST(MeshRings, BordersAndHoles) {
  check(cylinder_mesh(1, 2, 24, 9), "cylinder");
  check(slanted_strips(40), "strips");
  check(with_faces(torus_mesh(2, 0.5, 40, 17), [](auto& faces) { faces.erase(faces.begin() + 700); }),
        "torus without a triangle");
  check(with_faces(sphere_mesh(1, 4), [](auto& faces) { std::erase_if(faces, [](auto& f) { return f.x % 5 == 0; }); }),
        "sphere in pieces");
  const Mesh torus = torus_mesh(2, 0.5, 40, 17);
  std::vector<glm::vec3> vertices(torus.vertices().begin(), torus.vertices().end());
  vertices.insert(vertices.end(), 20, glm::vec3(0));
  check(make_mesh(vertices, torus.faces()), "torus with vertices of no triangle behind it");
}

TEST(MeshRings, OrientedAgainstEachOther) {
  check(with_faces(torus_mesh(2, 0.5, 40, 17), [](auto& faces) { std::swap(faces[700].x, faces[700].y); }),
        "torus with a triangle turned over");
  check(with_faces(torus_mesh(2, 0.5, 40, 17), [](auto& faces) { faces.push_back(faces[300]); }),
        "torus with a triangle twice");
}

// Two caps whose tips have many neighbours; at 12 the device makes the ring, and at 13 and more the host.
TEST(MeshRings, ManyNeighbours) {
  for (const std::uint32_t around : {11u, 12u, 13u, 31u, 32u, 33u, 80u}) {
    const Mesh cylinder = cylinder_mesh(1, 2, around, 4);
    std::vector<glm::vec3> vertices(cylinder.vertices().begin(), cylinder.vertices().end());
    const auto lower = std::uint32_t(vertices.size()), upper = lower + 1;
    vertices.push_back({0, 0, -0.5f});
    vertices.push_back({0, 0, 2.5f});
    check(with_faces(make_mesh(vertices, cylinder.faces()),
                     [&](auto& faces) {
                       // Each side that no other triangle has in the other direction is a border's.
                       std::set<std::pair<std::uint32_t, std::uint32_t>> sides;
                       for (const glm::uvec3& f : faces) sides.insert({{f.x, f.y}, {f.y, f.z}, {f.z, f.x}});
                       for (const auto& [a, b] : sides) {
                         if (!sides.contains({b, a})) faces.push_back({b, a, vertices[a].z < 1 ? lower : upper});
                       }
                     }),
          "cylinder with caps of " + std::to_string(around));
  }
}

// Enough triangles and vertices for more than one thread, and for many stretches of vertices to be sorted; a few have
// rings of the host.
TEST(MeshRings, ManyTriangles) {
  check(with_faces(torus_mesh(2, 0.5, 1000, 210),
                   [](auto& faces) {
                     std::size_t i = 0;
                     std::erase_if(faces, [&](auto&) { return i++ % 5000 == 70; });
                   }),
        "torus of 420,000 triangles with holes");
}

}  // namespace
}  // namespace smurf::test
