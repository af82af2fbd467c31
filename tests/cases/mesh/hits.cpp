// Rays against polygon meshes, on every device: the same faces in the same order as the reference finds by brute force
// in exact arithmetic, for rays in general position, of cameras, and for rays that meet vertices, edges and planes of
// triangles exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "harness/case.hpp"
#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/hit_list_oracle.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/replay.hpp"
#include "harness/tolerances.hpp"
#include "smurf/camera.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "truth/meshes.hpp"
#include "truth/rays.hpp"
#include "truth/trimesh.hpp"

KERNELS(find_hits, count_blocks, order_rows);

namespace smurf::test {
namespace {

constexpr std::string_view kind = "mesh";

// Lines through the bounding sphere's inside.
RayBatch random_chords(const Mesh& mesh, std::size_t count, unsigned seed) {
  return sphere_chords(mesh.lower(), mesh.upper(), count, seed);
}

RayBatch hostile_rays(const Mesh& mesh, std::size_t most) {
  return hostile_lines(mesh.vertices(), mesh.faces(), glm::length(mesh.upper() - mesh.lower()), most);
}

// The same face, and the same t and place in it. Both round the exact t to a float; a result that lies halfway between
// two floats may go either way.
Match same_hit(const HitList& found, const HitList& truth, const Hit& hit, const Root& root) {
  constexpr double t_allowed = tolerance(Quantity::t, kind).value,
                   place_allowed = tolerance(Quantity::coordinates, kind).value;
  const SurfaceCoordinates a = found.coordinates()[hit.index], b = truth.coordinates()[root.row];
  if (a.part != b.part) return {};
  const double t_error = std::abs(hit.t - root.t) / std::max(1e-30, std::abs(root.t));
  const double place_error = std::max(std::abs(double(a.u) - b.u), std::abs(double(a.v) - b.v));
  return {std::max(t_error / t_allowed, place_error / place_allowed), t_error};
}

// A case without its rays.
Case case_of(const Mesh& mesh, const Surface& surface, const std::string& name) {
  return {.name = name,
          .surface = surface,
          .replay = [mesh](const std::string& file, const Ray& ray, const std::string& device) {
            return replay_command(file, mesh, ray, device);
          }};
}

void expect_as_reference(const Mesh& mesh, const RayBatch& rays, const std::string& what, bool spatial_splits = false) {
  const Surface surface = mesh_surface(mesh, MeshNormals::face, spatial_splits);
  const Case one = case_of(mesh, surface, what);
  const HitList expected = Interrogator(reference_device(), surface).cast(rays, {.hits = Hits::all});
  for (TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, surface);
    const HitList all = query.cast(rays, {.hits = Hits::all}), first = query.cast(rays);
    ASSERT_EQ(all.ray_count(), rays.size()) << what;
    const HitListOracle oracle(expected, {.match = [&](const Ray&, const Hit& hit,
                                                       const Root& root) { return same_hit(all, expected, hit, root); },
                                          .doubtful_when_flagged = false,
                                          .unit = "relative"});
    expect_hits(one, "lines", rays, oracle, device, all);
    expect_first(all, first, what);
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
  for (int axis = 0; axis < 3; axis++)
    expect_as_reference(mesh, raster_lines(mesh.lower(), mesh.upper(), axis), name + ", raster");
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
  std::vector<Ray> rays;
  add_line(rays, {0.25f, 0.25f, -1}, {0, 0, 1});
  add_line(rays, {0.25f, 0.25f, 2}, {0, 0, -1});
  add_line(rays, {0, 0, -1}, {0, 0, 1});
  add_line(rays, {-1, 0.25f, 0}, {1, 0, 0});
  expect_as_reference(mesh, RayBatch(rays), "240 triangles in one place");
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

// Rays and meshes of trimesh's tests: the reference's counts are those of brute force in double (truth/trimesh.hpp),
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
