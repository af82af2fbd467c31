// Rays against polygon meshes, on every device: the same faces in the same order as the reference finds by brute force
// in exact arithmetic, for rays in general position, of cameras, and for rays that meet vertices, edges and planes of
// triangles exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <random>

#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/shared_data.hpp"
#include "smurf/camera.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "truth/meshes.hpp"
#include "truth/trimesh.hpp"

KERNELS(find_hits, count_blocks, order_rows);

namespace smurf::test {
namespace {

// Whole lines, as far as a mesh can be away.
constexpr float everywhere = 1e30f;

class Rays {
 public:
  void add(const glm::vec3& origin, const glm::vec3& direction) {
    if (direction == glm::vec3(0.0f)) return;
    Ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.t_min = -everywhere;
    ray.t_max = everywhere;
    rays_.push_back(ray);
  }
  RayBatch batch() const { return RayBatch(rays_); }

 private:
  std::vector<Ray> rays_;
};

// Lines through the bounding sphere's inside.
RayBatch random_chords(const Mesh& mesh, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  const glm::vec3 centre = 0.5f * (mesh.lower() + mesh.upper());
  const float radius = 0.5f * glm::length(mesh.upper() - mesh.lower());
  const auto on_sphere = [&] {
    return centre + radius * glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
  };
  Rays rays;
  for (std::size_t i = 0; i < count; i++) {
    const glm::vec3 from = on_sphere();
    rays.add(from, on_sphere() - from);
  }
  return rays.batch();
}

// Lines that meet vertices, edges and planes of triangles exactly or nearly, about `most` of each of ten families.
RayBatch hostile_rays(const Mesh& mesh, std::size_t most) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  const float size = glm::length(mesh.upper() - mesh.lower());
  const auto any = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
  const auto vertex = [&](std::size_t i) {
    return mesh.vertices()[i * std::max<std::size_t>(1, mesh.vertex_count() / most) % mesh.vertex_count()];
  };
  Rays rays;
  for (std::size_t i = 0; i < std::min(most, mesh.vertex_count()); i++) {
    const glm::vec3 p = vertex(i);
    rays.add(p, any());              // through a vertex, from it
    rays.add(p, vertex(i + 1) - p);  // from one to another, through it where the difference is exact
    for (int axis = 0; axis < 3; axis++) {
      glm::vec3 direction(0.0f), start = p;
      direction[axis] = i % 2 == 0 ? 1.0f : -1.0f;
      start[axis] -= 2 * size * direction[axis];
      rays.add(start, direction);
    }
  }
  for (std::size_t i = 0; i < std::min(most, mesh.face_count()); i++) {
    const glm::uvec3 f = mesh.faces()[i * std::max<std::size_t>(1, mesh.face_count() / most) % mesh.face_count()];
    const glm::vec3 a = mesh.vertices()[f.x], b = mesh.vertices()[f.y], c = mesh.vertices()[f.z];
    rays.add(a, b - a);                                               // along an edge
    rays.add(a, (b - a) + (c - a));                                   // in the plane
    rays.add(a - (b - a), 2.0f * (b - a) - (c - a));                  // in the plane, past the triangle
    rays.add(0.5f * (a + b), any());                                  // through the middle of an edge
    rays.add(a, glm::cross(glm::cross(b - a, c - a) / size, any()));  // grazing
  }
  return rays.batch();
}

// Parallel rays on a raster that vertices of lattices lie on, in an image's order: packets that meet edges and vertices
// together.
RayBatch raster(const Mesh& mesh, int axis) {
  constexpr int across = 32;
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const glm::vec3 lower = mesh.lower(), extent = mesh.upper() - mesh.lower();
  Rays rays;
  for (int j = 0; j < across; j++) {
    for (int i = 0; i < across; i++) {
      glm::vec3 origin = lower, direction(0.0f);
      origin[x] += extent[x] * float(i) / 16.0f - extent[x] / 2;
      origin[y] += extent[y] * float(j) / 16.0f - extent[y] / 2;
      origin[axis] -= extent[axis];
      direction[axis] = 1.0f;
      rays.add(origin, direction);
    }
  }
  RayBatch batch = rays.batch();
  batch.image_width = across;
  return batch;
}

// The same hits, in the same order. Both round the exact t to a float; a result that lies halfway between two floats
// may go either way.
void expect_same_hits(const HitList& found, const HitList& expected, const std::string& what) {
  std::size_t counts = 0, faces = 0, uneven = 0, worst_ray = 0;
  double t_error = 0, place_error = 0;
  for (std::size_t ray = 0; ray < expected.ray_count(); ray++) {
    const std::size_t begin = found.offsets()[ray], number = found.offsets()[ray + 1] - begin;
    const std::size_t truth = expected.offsets()[ray];
    if (number != expected.offsets()[ray + 1] - truth) {
      if (counts++ == 0) worst_ray = ray;
      continue;
    }
    for (std::size_t i = 0; i < number; i++) {
      if (found.coordinates()[begin + i].part != expected.coordinates()[truth + i].part) {
        if (faces++ == 0 && counts == 0) worst_ray = ray;
        continue;
      }
      const float t = found.t()[begin + i], exact = expected.t()[truth + i];
      if (t != exact) {
        uneven++;
        t_error = std::max(t_error, std::abs(double(t) - exact) / std::max(1e-30, std::abs(double(exact))));
      }
      const SurfaceCoordinates a = found.coordinates()[begin + i], b = expected.coordinates()[truth + i];
      place_error = std::max({place_error, std::abs(double(a.u) - b.u), std::abs(double(a.v) - b.v)});
    }
  }
  EXPECT_EQ(counts, 0u) << what << ": rays with another number of hits, the first is " << worst_ray;
  EXPECT_EQ(faces, 0u) << what << ": hits of another face, the first on ray " << worst_ray;
  // One unit in the last place.
  EXPECT_LE(t_error, 1.2e-7) << what << ": " << uneven << " times";
  // Weights by sums of two floats: off by their rounding to floats, and more in triangles that the ray nearly lies in.
  EXPECT_LE(place_error, 1e-5) << what;
}

void expect_as_reference(const Mesh& mesh, const RayBatch& rays, const std::string& what, bool spatial_splits = false) {
  const Surface surface = mesh_surface(mesh, MeshNormals::face, spatial_splits);
  const HitList expected = Interrogator(reference_device(), surface).cast(rays, {.hits = Hits::all});
  for (TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, surface);
    const HitList all = query.cast(rays, {.hits = Hits::all}), first = query.cast(rays);
    expect_same_hits(all, expected, what);
    // The first of all.
    std::size_t wrong = 0, at = 0;
    for (std::size_t ray = 0; ray < all.ray_count(); ray++) {
      const bool any = all.offsets()[ray + 1] > all.offsets()[ray];
      const std::size_t from_all = all.offsets()[ray];
      const bool same = first.offsets()[ray + 1] - at == (any ? 1u : 0u) &&
                        (!any || (first.coordinates()[at].part == all.coordinates()[from_all].part &&
                                  first.t()[at] == all.t()[from_all]));
      wrong += same ? 0 : 1;
      at = first.offsets()[ray + 1];
    }
    EXPECT_EQ(wrong, 0u) << what << ": rays whose first hit is not the first of all";
    if (mesh.topology().closed) {
      std::size_t odd = 0;
      for (std::size_t ray = 0; ray < all.ray_count(); ray++) odd += (all.offsets()[ray + 1] - all.offsets()[ray]) % 2;
      EXPECT_EQ(odd, 0u) << what << ": lines that cross a closed mesh an odd number of times";
    }
  }
}

void expect_all_as_reference(const Mesh& mesh, const std::string& name) {
  expect_as_reference(mesh, random_chords(mesh, 1000 * std::size_t(density()), 3), name + ", chords");
  expect_as_reference(mesh, hostile_rays(mesh, 150 * std::size_t(density())), name + ", hostile rays");
  for (int axis = 0; axis < 3; axis++) expect_as_reference(mesh, raster(mesh, axis), name + ", raster");
  const Bounds bounds{glm::dvec3(mesh.lower()), glm::dvec3(mesh.upper())};
  expect_as_reference(mesh, fitted_camera(bounds, 48, 40).rays(), name + ", camera");
}

TEST(MeshHits, Box) { expect_all_as_reference(box_mesh(glm::vec3(-1), glm::vec3(1), 8), "box"); }

TEST(MeshHits, Torus) { expect_all_as_reference(torus_mesh(3, 1, 48, 24), "torus"); }

TEST(MeshHits, OpenCylinder) { expect_all_as_reference(cylinder_mesh(1, 2, 40, 10), "cylinder"); }

TEST(MeshHits, ScalesAndPlaces) {
  for (const double scale : {1e-6, 1e6}) {
    const Mesh sphere = placed(sphere_mesh(1, 3), scale, glm::dvec3(0.0));
    expect_as_reference(sphere, hostile_rays(sphere, 100), "sphere of radius " + std::to_string(scale));
    // Rounded to floats far away, triangles are folded, but the mesh stays closed.
    const Mesh far = placed(sphere_mesh(1, 2), scale, scale * glm::dvec3(1300, -700, 400));
    expect_as_reference(far, hostile_rays(far, 100), "sphere far away, of radius " + std::to_string(scale));
  }
}

// Rays for a mesh, for the same mesh scaled; directions every second time.
RayBatch scaled(const RayBatch& rays, double scale) {
  RayBatch result(rays.size());
  for (std::size_t i = 0; i < rays.size(); i++) {
    Ray ray = rays[i];
    ray.origin = glm::vec3(scale * glm::dvec3(ray.origin));
    if (i % 2 == 0) ray.direction = glm::vec3(scale * glm::dvec3(ray.direction));
    ray.t_min = -3e38f;
    ray.t_max = 3e38f;
    result.set(i, ray);
  }
  result.image_width = rays.image_width;
  return result;
}

// Long thin triangles aslant, which spatial splits put into two leaves each in the mean (mesh_test.cpp): every hit is
// still told once. More than twelve of a ray's hits are sorted in another way than fewer.
TEST(MeshHits, SpatialSplits) {
  const Mesh strips = slanted_strips(600);
  expect_as_reference(strips, random_chords(strips, 3000, 9), "strips, chords", true);
  const Bounds bounds{glm::dvec3(strips.lower()), glm::dvec3(strips.upper())};
  expect_as_reference(strips, fitted_camera(bounds, 48, 48).rays(), "strips, camera", true);
  expect_as_reference(strips, hostile_rays(strips, 40), "strips, hostile rays", true);
  const Mesh torus = torus_mesh(3, 0.02, 60, 40);
  expect_as_reference(torus, hostile_rays(torus, 40), "torus, hostile rays", true);
  expect_as_reference(torus, random_chords(torus, 1000, 10), "torus, chords", true);
}

// As far as floats go: below, components of origins are too small to be read whole; above, the way to the mesh is too
// long for a float.
TEST(MeshHits, ExtremeSizes) {
  const Mesh unit = sphere_mesh(1, 3);
  for (const double scale : {1e-35, 1e-30, 1e-18, 1e18, 1e30, 1e37}) {
    const std::string what = "sphere of radius " + std::to_string(std::log10(scale));
    const Mesh mesh = placed(unit, scale, glm::dvec3(0.0));
    expect_as_reference(mesh, scaled(hostile_rays(unit, 40), scale), what + ", hostile rays");
    expect_as_reference(mesh, scaled(random_chords(unit, 300, 5), scale), what + ", chords");
    expect_as_reference(mesh, scaled(fitted_camera({glm::dvec3(-1), glm::dvec3(1)}, 24, 24).rays(), scale),
                        what + ", camera");
  }
}

// Directions so long or so short that t is near the ends of floats.
TEST(MeshHits, ExtremeDirections) {
  const Mesh mesh = sphere_mesh(1, 2);
  for (const float length : {1e-36f, 1e-20f, 1e20f, 1e36f}) {
    RayBatch rays = random_chords(mesh, 200, 6);
    for (std::size_t i = 0; i < rays.size(); i++) {
      Ray ray = rays[i];
      ray.direction *= length;
      ray.t_min = -3e38f;
      ray.t_max = 3e38f;
      rays.set(i, ray);
    }
    expect_as_reference(mesh, rays, "directions of length " + std::to_string(std::log10(length)));
  }
}

// Rays from where a float's step is larger than the mesh: answered as far as is promised, refused beyond.
TEST(MeshHits, RaysFromFarAway) {
  const Mesh mesh = placed(sphere_mesh(1, 2), 1e-6, glm::dvec3(0.0));
  std::vector<Ray> list;
  for (const float x : {1.0f, 1e4f, 1e5f, 1e7f, 1e20f}) {
    Ray ray;
    ray.origin = {-x, 0, 2.5e-7f};
    ray.direction = {1, 0, 0};
    list.push_back(ray);
  }
  const RayBatch rays{std::span<const Ray>(list)};
  for (TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, mesh_surface(mesh));
    const HitList hits = query.cast(rays, {.hits = Hits::all});
    for (std::size_t i = 0; i < list.size(); i++) {
      EXPECT_EQ(hits.ray_status()[i], i < 3 ? RayStatus::ok : RayStatus::invalid) << i;
      EXPECT_EQ(hits.offsets()[i + 1] - hits.offsets()[i], i < 3 ? 2u : 0u) << i;
    }
    EXPECT_THROW(query.cast(rays, {.bad_rays = BadRays::error}), Error);
  }
}

// Many triangles in one place: a hierarchy that cannot divide them, and rays with many hits at one t.
TEST(MeshHits, TrianglesInOnePlace) {
  std::vector<glm::vec3> vertices{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  std::vector<glm::uvec3> faces(200, glm::uvec3(0, 1, 2));
  for (int i = 0; i < 40; i++) {
    const auto first = std::uint32_t(vertices.size());
    for (int k = 0; k < 3; k++) vertices.push_back(vertices[std::size_t(k)] + glm::vec3(0, 0, 0.125f * float(i / 8)));
    faces.emplace_back(first, first + 1, first + 2);
  }
  const Mesh mesh = make_mesh(vertices, faces);
  Rays rays;
  rays.add({0.25f, 0.25f, -1}, {0, 0, 1});
  rays.add({0.25f, 0.25f, 2}, {0, 0, -1});
  rays.add({0, 0, -1}, {0, 0, 1});
  rays.add({-1, 0.25f, 0}, {1, 0, 0});
  expect_as_reference(mesh, rays.batch(), "240 triangles in one place");
}

TEST(MeshHits, OneTriangle) {
  const Mesh mesh =
      make_mesh(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, std::vector<glm::uvec3>{{0, 1, 2}});
  expect_as_reference(mesh, hostile_rays(mesh, 10), "one triangle");
  expect_as_reference(mesh, random_chords(mesh, 200, 9), "one triangle");
}

// Ranges of t end where a hit is, or beside it.
TEST(MeshHits, EndsOfRays) {
  const Mesh mesh = box_mesh(glm::vec3(0), glm::vec3(1), 2);
  std::vector<Ray> list;
  for (const float t : {1.0f, std::nextafter(1.0f, 2.0f), std::nextafter(1.0f, 0.0f)}) {
    Ray ray;
    ray.origin = {0.3f, 0.4f, -1};
    ray.direction = {0, 0, 1};
    ray.t_min = t;
    list.push_back(ray);
    ray.t_min = 0;
    ray.t_max = t;
    list.push_back(ray);
  }
  const RayBatch rays{std::span<const Ray>(list)};
  const Surface surface = mesh_surface(mesh);
  const std::vector<std::uint64_t> expected{2, 1, 1, 1, 2, 0};
  std::vector<Device> devices{reference_device()};
  for (TestDevice& device : test_devices()) devices.push_back(device.device);
  for (const Device& device : devices) {
    const HitList hits = Interrogator(device, surface).cast(rays, {.hits = Hits::all});
    for (std::size_t i = 0; i < expected.size(); i++)
      EXPECT_EQ(hits.offsets()[i + 1] - hits.offsets()[i], expected[i]) << device.info().name << ", ray " << i;
  }
}

// A million lines (ten with SMURF_TEST_DENSE=10) through a closed mesh.
TEST(MeshHits, ParityOfManyLines) {
  TestDevice* device = test_device("opencl");
  if (!device) {
    report_missing("OpenCL");
    GTEST_SKIP() << "no OpenCL";
  }
  const Mesh mesh = torus_mesh(3, 1, 200, 100);
  const Interrogator query(device->device, mesh_surface(mesh));
  for (std::size_t part = 0; part < 2 * std::size_t(density()); part++) {
    const HitList hits = query.cast(random_chords(mesh, 500000, unsigned(part)), {.hits = Hits::all});
    std::size_t odd = 0;
    for (std::size_t ray = 0; ray < hits.ray_count(); ray++) odd += (hits.offsets()[ray + 1] - hits.offsets()[ray]) % 2;
    EXPECT_EQ(odd, 0u);
    EXPECT_GT(hits.size(), 200000u);  // of 285,000
  }
}

// Rays and meshes of trimesh's tests: the reference's counts are those of brute force in double (harness/trimesh.hpp),
// here of rays rounded to floats.
TEST(MeshHits, CrossingsOfTrimeshsRays) {
  if (!has_shared_data("expected")) GTEST_SKIP();
  for (const TrimeshCase& known : trimesh_cases()) {
    SCOPED_TRACE(known.name);
    const RayBatch rays{std::span<const Ray>(known.rays)};
    const Mesh mesh = load_mesh(known.file);
    std::vector<Device> devices{reference_device()};
    for (TestDevice& device : test_devices()) devices.push_back(device.device);
    for (const Device& device : devices) {
      const HitList hits = Interrogator(device, mesh_surface(mesh)).cast(rays, {.hits = Hits::all});
      std::size_t hit = 0;
      double sum = 0;
      for (std::size_t ray = 0; ray < known.rays.size(); ray++) {
        if (hits.offsets()[ray + 1] == hits.offsets()[ray]) continue;
        hit++;
        sum += hits.t()[hits.offsets()[ray]];
      }
      EXPECT_EQ(hit, known.rays_that_hit) << device.info().name;
      EXPECT_EQ(hits.size(), known.crossings) << device.info().name;
      // Rays rounded to floats are off by 6e-8 of their coordinates.
      EXPECT_NEAR(sum, known.sum_of_nearest_t, 2e-6 * known.sum_of_nearest_t) << device.info().name;
    }
    expect_as_reference(mesh, rays, known.name);
  }
}

TEST(MeshHits, SharedMeshes) {
  if (!has_shared_data("meshes")) GTEST_SKIP();
  for (const std::string file : {"cgal_elephant.off", "cgal_ellipe0.003.off", "cgal_knot2.off",
                                 "cgal_poly2x2+y2-0.0625.off", "cgal_sphere966.off", "libigl_bunny.off", "spot.obj"}) {
    const Mesh mesh = load_mesh(shared_data("meshes") / file);
    expect_as_reference(mesh, hostile_rays(mesh, 60 * std::size_t(density())), file + ", hostile rays");
    expect_as_reference(mesh, random_chords(mesh, 500 * std::size_t(density()), 5), file + ", chords");
    const Bounds bounds{glm::dvec3(mesh.lower()), glm::dvec3(mesh.upper())};
    expect_as_reference(mesh, fitted_camera(bounds, 40, 40).rays(), file + ", camera");
  }
}

}  // namespace
}  // namespace smurf::test
