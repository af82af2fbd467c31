// The reference for meshes: every ray crosses a closed mesh an even number of times, whatever it meets; numbers of hits
// against closed forms and against a plain intersection in long double; nearest points, normals and curvature.
#include "reference/mesh/brute_force.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "harness/density.hpp"
#include "reference/mesh/vertices.hpp"
#include "truth/meshes.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;

ReferenceRay line(const glm::vec3& origin, const glm::vec3& direction) {
  return {dvec3(origin), dvec3(direction), -infinity, infinity};
}

// What the whole line through a closed, consistently oriented mesh must show: an even number of hits, as many ways in
// as out. Which way it is cannot be told in double of triangles that are nearly parallel to the ray.
void expect_in_and_out(const ReferenceMesh& reference, const ReferenceRay& ray) {
  int ways_in = 0, ways_out = 0, either = 0;
  for (const MeshHit& hit : reference.hits(ray, false)) {
    const double slope = glm::dot(reference.face_normal(hit.at.face), ray.direction);
    const bool parallel = std::abs(slope) < 1e-14 * glm::length(ray.direction);
    (parallel ? either : slope < 0 ? ways_in : ways_out)++;
  }
  EXPECT_EQ((ways_in + ways_out + either) % 2, 0);
  EXPECT_LE(std::abs(ways_in - ways_out), either)
      << "ray from " << ray.origin.x << " " << ray.origin.y << " " << ray.origin.z << " along " << ray.direction.x
      << " " << ray.direction.y << " " << ray.direction.z;
}

// Rays that meet vertices, edges and planes of triangles exactly, at most `most` of each kind.
std::vector<ReferenceRay> hostile_rays(const Mesh& mesh, std::size_t most) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  const float size = glm::length(mesh.upper() - mesh.lower());
  const auto any_direction = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
  const auto pick = [&](std::size_t i, std::size_t count) {
    return i * std::max<std::size_t>(1, count / most) % count;
  };
  std::vector<ReferenceRay> rays;
  for (std::size_t i = 0; i < std::min(most, mesh.vertex_count()); i++) {
    const glm::vec3 p = mesh.vertices()[pick(i, mesh.vertex_count())];
    // From the vertex outward: the line goes through it exactly.
    rays.push_back(line(p, any_direction()));
    for (int axis = 0; axis < 3; axis++) {
      glm::vec3 d(0.0f), start = p;
      d[axis] = i % 2 == 0 ? 1.0f : -1.0f;
      start[axis] -= 2 * size * d[axis];
      rays.push_back(line(start, d));
    }
    // To another vertex; exact where the difference is.
    rays.push_back(line(p, mesh.vertices()[pick(i + 1, mesh.vertex_count())] - p));
  }
  for (std::size_t i = 0; i < std::min(most, mesh.face_count()); i++) {
    const glm::uvec3 f = mesh.faces()[pick(i, mesh.face_count())];
    const glm::vec3 a = mesh.vertices()[f.x], b = mesh.vertices()[f.y], c = mesh.vertices()[f.z];
    rays.push_back(line(a, b - a));
    rays.push_back(line(b - (c - b), c - b));
    // In the triangle's plane where the arithmetic is exact, and nearly in it elsewhere.
    rays.push_back(line(a, (b - a) + (c - a)));
    rays.push_back(line(a + (b - a), 2.0f * (b - a) - (c - a)));
    // Through the middle of an edge.
    rays.push_back(line(0.5f * (a + b), any_direction()));
    // Grazing: along the plane of the vertex normal.
    rays.push_back(line(a, glm::cross(glm::cross(b - a, c - a), any_direction())));
  }
  return rays;
}

void expect_parity(const Mesh& mesh, std::size_t most) {
  ASSERT_TRUE(mesh.topology().closed);
  ASSERT_EQ(mesh.topology().inconsistent_edges, 0u);
  const ReferenceMesh reference(mesh);
  for (const ReferenceRay& ray : hostile_rays(mesh, most)) {
    if (ray.direction == dvec3(0.0)) continue;
    expect_in_and_out(reference, ray);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(MeshReference, EveryLineEntersAsOftenAsItLeaves) {
  for (const double scale : {1.0, 1e-6, 1e6, 1e-30, 1e30}) {
    for (const double away : {0.0, 1e3, 1e6}) {
      SCOPED_TRACE(testing::Message() << "scale " << scale << ", " << away << " sizes away");
      // Rounding to floats folds a mesh far away, but keeps it closed as long as no triangle loses its area.
      const dvec3 offset = away * scale * dvec3(1.3, -0.7, 0.4);
      for (const Mesh& mesh : {test::box_mesh(glm::vec3(-1), glm::vec3(1), 4), test::sphere_mesh(1, 2)}) {
        const Mesh moved = test::placed(mesh, scale, offset);
        if (moved.repairs() == MeshRepairs()) expect_parity(moved, 60 / test::sanitized_part);
      }
      expect_parity(test::placed(test::box_mesh(glm::vec3(-2), glm::vec3(2), 1), scale, offset),
                    60 / test::sanitized_part);
    }
  }
  expect_parity(test::torus_mesh(3, 1, 32, 16), 200 / test::sanitized_part);
}

// All lines of a lattice through a box of cubes: every line runs in planes of triangles, along edges, or through
// vertices.
TEST(MeshReference, LatticeLinesThroughLatticeBoxes) {
  const Mesh mesh = test::box_mesh(glm::vec3(0), glm::vec3(3), 3);
  const ReferenceMesh reference(mesh);
  std::size_t through = 0, past = 0;
  for (int x = -1; x <= 4; x++) {
    for (int y = -1; y <= 4; y++) {
      for (int dx = -2; dx <= 2; dx++) {
        for (int dy = -2; dy <= 2; dy++) {
          for (int dz = 0; dz <= 2; dz++) {
            if (dx == 0 && dy == 0 && dz == 0) continue;
            const ReferenceRay ray = line({x, y, 0}, {dx, dy, dz});
            expect_in_and_out(reference, ray);
            const std::size_t count = reference.hits(ray, false).size();
            // The box is convex.
            EXPECT_LE(count, 2u);
            (count == 2 ? through : past)++;
          }
        }
      }
    }
  }
  EXPECT_GT(through, 400u);
  EXPECT_GT(past, 400u);
}

// The documented rule: a line that meets a vertex or an edge goes as the line does that is moved a little, first along
// x, less along y, least along z. A move by true small steps, in a mesh of integers where these are exact, must find
// the same triangles.
TEST(MeshReference, GoesAsALineBesideIt) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> step(-3, 3);
  std::vector<glm::vec3> vertices;
  for (int i = 0; i < 40; i++) vertices.emplace_back(step(random), step(random), step(random));
  std::vector<glm::uvec3> faces;
  std::uniform_int_distribution<std::uint32_t> any(0, 39);
  for (int i = 0; i < 200; i++) faces.emplace_back(any(random), any(random), any(random));
  const ReferenceMesh reference(make_mesh(vertices, faces));
  std::size_t hits = 0, exact = 0;
  for (int i = 0; i < 3000; i++) {
    const glm::vec3 origin(step(random), step(random), step(random)),
        direction(step(random), step(random), step(random));
    if (direction == glm::vec3(0)) continue;
    const ReferenceRay ray = line(origin, direction);
    ReferenceRay beside = ray;
    beside.origin += dvec3(0x1p-12, 0x1p-24, 0x1p-36);
    auto found = reference.hits(ray, false), expected = reference.hits(beside, false);
    const auto by_face = [](const MeshHit& a, const MeshHit& b) { return a.at.face < b.at.face; };
    std::ranges::sort(found, by_face);
    std::ranges::sort(expected, by_face);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k < found.size(); k++) {
      EXPECT_EQ(found[k].at.face, expected[k].at.face);
      EXPECT_NEAR(found[k].t, expected[k].t, 0.01);
      exact += found[k].at.u == 0 || found[k].at.v == 0 || found[k].at.u + found[k].at.v == 1;
    }
    hits += found.size();
  }
  EXPECT_GT(hits, 5000u);
  EXPECT_GT(exact, 1000u) << "too few hits on edges";
}

// One triangle: t and barycentrics against long double, from near and far, for triangles down to slivers.
TEST(MeshReference, NumbersOfHits) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (int i = 0; i < 4000; i++) {
    const auto any = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    const float thin = i % 3 == 0 ? 1e-4f : 1.0f, far = i % 2 == 0 ? 1.0f : 1e5f;
    const glm::vec3 a = any(), b = a + any(), c = a + 0.4f * (b - a) + thin * any();
    const std::vector<glm::vec3> vertices = {a, b, c};
    const std::vector<glm::uvec3> faces = {{0, 1, 2}};
    const ReferenceMesh reference(make_mesh(vertices, faces));
    const dvec3 target = reference.location({0, 0.3, 0.5});
    const glm::vec3 direction = any(), origin(target - double(far) * dvec3(direction));
    const auto hits = reference.hits(line(origin, direction), false);
    if (thin == 1 && far == 1) {
      ASSERT_EQ(hits.size(), 1u);
    }
    for (const MeshHit& hit : hits) {
      const dvec3 on_ray = dvec3(origin) + hit.t * dvec3(direction), on_face = reference.location(hit.at);
      EXPECT_LE(glm::distance(on_ray, on_face), 4e-16 * (2 + 3.0 * far)) << "triangle " << i;
      EXPECT_GE(hit.at.u, 0);
      EXPECT_GE(hit.at.v, 0);
      EXPECT_LE(hit.at.u + hit.at.v, 1);
    }
  }
}

TEST(MeshReference, KeepsHitsOfTheRangeInOrder) {
  const Mesh mesh = test::box_mesh(glm::vec3(-1), glm::vec3(1), 1);
  const ReferenceMesh reference(mesh);
  const auto count = [&](double t_min, double t_max) {
    return reference.hits({{-3, 0.25, 0.125}, {1, 0, 0}, t_min, t_max}, false).size();
  };
  EXPECT_EQ(count(0, infinity), 2u);
  EXPECT_EQ(count(2, 4), 2u);  // the ends belong to the range
  EXPECT_EQ(count(2, 2), 1u);
  EXPECT_EQ(count(std::nextafter(2.0, 3.0), 4), 1u);
  EXPECT_EQ(count(4.5, infinity), 0u);
  EXPECT_EQ(count(-infinity, 0), 0u);
  const auto first = reference.hits({{-3, 0.25, 0.125}, {1, 0, 0}, 0, infinity}, true);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].t, 2);

  // Many triangles in one place: by t, then by face.
  const std::vector<glm::vec3> vertices = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<glm::uvec3> faces = {{0, 1, 2}, {3, 4, 5}, {0, 2, 1}, {4, 5, 3}};
  const auto hits = ReferenceMesh(make_mesh(vertices, faces)).hits({{0.25, 0.25, -1}, {0, 0, 1}}, false);
  ASSERT_EQ(hits.size(), 4u);
  const std::uint32_t order[] = {1, 3, 0, 2};
  for (std::size_t k = 0; k < 4; k++) EXPECT_EQ(hits[k].at.face, order[k]);
}

// The nearest of a dense set of points of each triangle is never nearer, and not much farther.
TEST(MeshReference, NearestPoints) {
  const Mesh mesh = test::sphere_mesh(1, 2, {0.2, 0, 0});
  const ReferenceMesh reference(mesh);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-2, 2);
  constexpr int steps = 24;
  for (int i = 0; i < 100; i++) {
    const dvec3 point(uniform(random), uniform(random), uniform(random));
    const NearestMeshPoint nearest = reference.nearest(point);
    EXPECT_NEAR(glm::distance(reference.location(nearest.at), point), nearest.distance, 1e-15);
    double least = infinity;
    for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
      for (int u = 0; u <= steps; u++) {
        for (int v = 0; u + v <= steps; v++)
          least =
              std::min(least, glm::distance(reference.location({face, double(u) / steps, double(v) / steps}), point));
      }
    }
    EXPECT_LE(nearest.distance, least + 1e-15);
    EXPECT_GE(nearest.distance, least - 0.02);
  }
  const dvec3 at_vertex(mesh.vertices()[5]);
  EXPECT_EQ(reference.nearest(at_vertex).distance, 0);
}

// ---- Normals and curvature

struct Errors {
  double normal = 0, mean = 0, gauss = 0, k1 = 0, k2 = 0, direction = 0;
};

using Truth = test::MeshTruth;

// The greatest errors at the middles of the triangles that `inside` takes.
Errors greatest_errors(const Mesh& mesh, const std::function<Truth(const dvec3&)>& truth,
                       const std::function<bool(const dvec3&)>& inside) {
  const ReferenceMesh reference(mesh);
  Errors worst;
  for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
    const MeshPoint middle{face, 1.0 / 3, 1.0 / 3};
    const dvec3 place = reference.location(middle);
    if (!inside(place)) continue;
    const SurfaceFrame frame = reference.measure(middle, false);
    const Truth expected = truth(place);
    const auto widen = [](double& error, double value) {
      error = std::isnan(value) ? infinity : std::max(error, std::abs(value));
    };
    widen(worst.normal, glm::distance(frame.normal, expected.normal));
    widen(worst.k1, frame.k1 - expected.k1);
    widen(worst.k2, frame.k2 - expected.k2);
    widen(worst.mean, 0.5 * (frame.k1 + frame.k2 - expected.k1 - expected.k2));
    widen(worst.gauss, frame.k1 * frame.k2 - expected.k1 * expected.k2);
    if (expected.k1 > expected.k2) widen(worst.direction, 1 - std::abs(glm::dot(frame.d1, expected.d1)));
  }
  return worst;
}

// Errors of curvature fall with the square of the edges' length (interpolation between vertices is linear), to a third
// or less with half the length; those of angle-weighted normals with the length itself where triangles lie irregularly
// about a vertex.
TEST(MeshReference, CurvatureOfFinerAndFinerMeshes) {
  const auto sphere = [](const dvec3& p) { return Truth{glm::normalize(p), 0.5, 0.5, dvec3(0.0)}; };
  const auto cylinder = [](const dvec3& p) {
    const dvec3 normal = glm::normalize(dvec3(p.x, p.y, 0));
    return Truth{normal, 0.5, 0, dvec3(-normal.y, normal.x, 0)};
  };
  const auto torus = [](const dvec3& p) { return test::torus_truth(3, 1, p); };
  const auto away_from_ends = [](const dvec3& p) { return p.z > 0.5 && p.z < 2.5; };
  Errors last[3];
  for (int level = 0; level < 3; level++) {
    const std::uint32_t n = 16u << level;
    const Errors now[] = {greatest_errors(test::sphere_mesh(2, 3 + level), sphere, test::everywhere),
                          greatest_errors(test::cylinder_mesh(2, 3, 2 * n, n), cylinder, away_from_ends),
                          greatest_errors(test::torus_mesh(3, 1, 3 * n, n), torus, test::everywhere)};
    for (int kind = 0; kind < 3; kind++) {
      std::cout << "level " << level << " kind " << kind << ": normal " << now[kind].normal << " k1 " << now[kind].k1
                << " k2 " << now[kind].k2 << " direction " << now[kind].direction << "\n";
      if (level > 0) {
        EXPECT_LT(now[kind].k1, last[kind].k1 / 3);
        EXPECT_LT(now[kind].k2, std::max(last[kind].k2 / 3, 1e-12));
        EXPECT_LT(now[kind].normal, std::max(last[kind].normal / 1.9, 1e-6));
      }
      if (level == 2) {
        EXPECT_LT(now[kind].k1, 4e-3);
        EXPECT_LT(now[kind].k2, 2e-3);
        EXPECT_LT(now[kind].normal, 4e-3);
        EXPECT_LT(now[kind].direction, 1e-3);
      }
      last[kind] = now[kind];
    }
  }
}

TEST(MeshReference, StatusOfPoints) {
  // A flat square: curvature 0, umbilic, at the border with its status.
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  for (std::uint32_t j = 0; j < 9; j++) {
    for (std::uint32_t i = 0; i < 9; i++) {
      vertices.emplace_back(i, j, 0);
      const std::uint32_t a = 9 * j + i;
      if (i < 8 && j < 8) faces.insert(faces.end(), {{a, a + 1, a + 10}, {a, a + 10, a + 9}});
    }
  }
  const ReferenceMesh square(make_mesh(vertices, faces));
  const SurfaceFrame corner = square.measure({0, 0.2, 0.2}, false), inside = square.measure({54, 0.2, 0.2}, false);
  EXPECT_EQ(corner.status, PointStatus::boundary | PointStatus::umbilic);
  EXPECT_EQ(inside.status, PointStatus::umbilic);
  EXPECT_NEAR(inside.k1, 0, 1e-12);
  EXPECT_EQ(inside.normal, dvec3(0, 0, 1));
  // Where three sheets meet there is a normal of the face, but no curvature.
  vertices.emplace_back(4.5f, 4.5f, 3.0f);
  faces.emplace_back(4 * 9 + 4, 4 * 9 + 5, 81);
  const ReferenceMesh fin(make_mesh(vertices, faces));
  const SurfaceFrame at_fin = fin.measure({128, 0.2, 0.2}, true);
  EXPECT_EQ(at_fin.status & PointStatus::undefined, PointStatus::undefined);
  EXPECT_TRUE(std::isnan(at_fin.k1));
  EXPECT_NEAR(std::abs(at_fin.normal.y), 3 / std::hypot(3.0, 0.5), 1e-12);
  // Too few points for a curvature.
  const std::vector<glm::vec3> four = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<glm::uvec3> sides = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const SurfaceFrame few = ReferenceMesh(make_mesh(four, sides)).measure({0, 0.25, 0.25}, true);
  EXPECT_EQ(few.status, PointStatus::undefined);
  EXPECT_EQ(few.normal, dvec3(0, 0, -1));
}

}  // namespace
}  // namespace smurf
