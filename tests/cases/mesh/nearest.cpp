// The nearest points of meshes on every device, against the reference, and what is probed there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "device/executor.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "reference/mesh/brute_force.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/resident_surface.hpp"
#include "truth/meshes.hpp"

KERNELS(find_nearest, measure);

namespace smurf::test {
namespace {

using glm::dvec3;

std::vector<SurfaceCoordinates> nearest_on(const TestDevice& device, const Mesh& mesh,
                                           const std::vector<glm::vec3>& points) {
  Executor& executor = device.device.executor();
  const auto surface = reside(mesh_surface(mesh).model(), executor, {});
  TypedBuffer<glm::vec3> places(executor, points.size(), "points");
  places.write(points);
  TypedBuffer<SurfaceCoordinates> found(executor, points.size(), "coordinates");
  Program program = surface->program(KernelId::find_nearest);
  program.defines["COORDINATES"] = "1";
  launch(executor, program,
         arguments::find_nearest{.surface = surface->buffers(),
                                 .points = places.get(),
                                 .coordinates = found.get(),
                                 .first = 0,
                                 .end = int(points.size())},
         points.size());
  std::vector<SurfaceCoordinates> result(points.size());
  found.read(result);
  return result;
}

// The distance is right to 2^-21 of the greatest coordinate (kernels/mesh/nearest.inc).
void expect_nearest(const std::string& name, const Mesh& mesh, const std::vector<glm::vec3>& points) {
  const ReferenceMesh reference(mesh);
  for (const TestDevice& device : test_devices()) {
    const std::vector<SurfaceCoordinates> found = nearest_on(device, mesh, points);
    double worst = 0;
    for (std::size_t i = 0; i < points.size(); i++) {
      const SurfaceCoordinates& at = found[i];
      ASSERT_LT(at.part, mesh.face_count());
      ASSERT_TRUE(at.u >= 0 && at.v >= 0 && double(at.u) + double(at.v) <= 1 + 1e-7) << at.u << ", " << at.v;
      const dvec3 point(points[i]),
          size = glm::max(glm::abs(point), glm::max(glm::abs(dvec3(mesh.lower())), glm::abs(dvec3(mesh.upper()))));
      const double distance = glm::distance(reference.location({at.part, at.u, at.v}), point),
                   least = reference.nearest(point).distance;
      const double error = (distance - least) / std::max({size.x, size.y, size.z});
      ASSERT_LT(error, 0x1p-21) << name << ", " << device.label << ", point " << point.x << ", " << point.y << ", "
                                << point.z << ": " << distance << " is not " << least;
      worst = std::max(worst, error);
    }
    std::cerr << "  " << name << ", " << device.label << ": " << worst / 0x1p-24 << " roundings\n";
  }
}

std::vector<glm::vec3> points_about(const Mesh& mesh, int count, float reach) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(-reach, reach);
  std::uniform_int_distribution<std::uint32_t> face(0, std::uint32_t(mesh.face_count() - 1));
  const glm::vec3 middle = 0.5f * (mesh.lower() + mesh.upper()), size = mesh.upper() - mesh.lower();
  std::vector<glm::vec3> points;
  for (int i = 0; i < count; i++) {
    const glm::vec3 r(uniform(random), uniform(random), uniform(random));
    const glm::uvec3 f = mesh.faces()[face(random)];
    const glm::vec3 a = mesh.vertices()[f.x], b = mesh.vertices()[f.y], c = mesh.vertices()[f.z];
    if (i % 4 == 0) points.push_back(middle + r * size);
    if (i % 4 == 1) points.push_back(a);
    if (i % 4 == 2) points.push_back(0.5f * a + 0.3f * b + 0.2f * c + 1e-3f * r * size);
    if (i % 4 == 3) points.push_back(0.5f * (a + b));
  }
  return points;
}

TEST(MeshNearest, AsTheReferenceTells) {
  expect_nearest("torus", torus_mesh(3, 1, 48, 16), points_about(torus_mesh(3, 1, 48, 16), 600, 2));
  if (has_shared_data("meshes")) {
    const Mesh elephant = load_mesh(shared_data("meshes/cgal_elephant.off"));
    expect_nearest("elephant", elephant, points_about(elephant, 400, 1));
    expect_nearest("elephant from afar", elephant, points_about(elephant, 100, 1e4f));
  }
  const Mesh far = placed(torus_mesh(3, 1, 24, 12), 1e-3, {1, 2, 3});
  expect_nearest("small and far from the origin", far, points_about(far, 200, 2));
  const Mesh huge = placed(torus_mesh(3, 1, 24, 12), 1e25, {0, 0, 0});
  expect_nearest("huge", huge, points_about(huge, 200, 2));
  const Mesh tiny = placed(torus_mesh(3, 1, 24, 12), 1e-25, {0, 0, 0});
  expect_nearest("tiny", tiny, points_about(tiny, 200, 2));
}

// Triangles from well-formed down to a millionth as high as they are long, each alone.
TEST(MeshNearest, Slivers) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const auto any = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
  for (const float thin : {1.0f, 1e-2f, 1e-4f, 1e-6f}) {
    std::vector<glm::vec3> vertices, points;
    std::vector<glm::uvec3> faces;
    for (std::uint32_t i = 0; i < 40; i++) {
      const glm::vec3 a = any(), b = a + any(), c = a + 0.4f * (b - a) + thin * any();
      vertices.insert(vertices.end(), {a, b, c});
      faces.push_back(i % 3 == 0   ? glm::uvec3(3 * i, 3 * i + 1, 3 * i + 2)
                      : i % 3 == 1 ? glm::uvec3(3 * i + 1, 3 * i + 2, 3 * i)
                                   : glm::uvec3(3 * i + 2, 3 * i, 3 * i + 1));
      points.insert(points.end(), {any(), 2.0f * any(), (a + b + c) / 3.0f, (a + b + c) / 3.0f + 0.01f * any(), c});
    }
    expect_nearest("slivers of " + std::to_string(thin), make_mesh(vertices, faces), points);
  }
}

// What is probed at a point is what the surface is at the point of it that is nearest; a point that is no number has
// none.
TEST(MeshNearest, Probes) {
  const Mesh mesh = sphere_mesh(2, 4);
  std::vector<glm::vec3> points = points_about(mesh, 64, 1.5f);
  points[5] = glm::vec3(std::numeric_limits<float>::quiet_NaN(), 0, 0);
  points[6] = glm::vec3(0, std::numeric_limits<float>::infinity(), 0);
  const PointProperties expected = Interrogator(reference_device(), mesh_surface(mesh, MeshNormals::interpolated))
                                       .probe(points, Property::normal | Property::mean);
  for (const TestDevice& device : test_devices()) {
    const Interrogator query(device.device, mesh_surface(mesh, MeshNormals::interpolated));
    const PointProperties p = query.probe(points, Property::normal | Property::mean, {.tile = 10});
    for (std::size_t i = 0; i < points.size(); i++) {
      const std::string where = device.label + ", point " + std::to_string(i);
      if (i == 5 || i == 6) {
        EXPECT_EQ(p.status[i], PointStatus::undefined) << where;
        EXPECT_TRUE(std::isnan(p.normal[i].x) && std::isnan(p.mean[i])) << where;
        continue;
      }
      EXPECT_EQ(p.status[i] & (PointStatus::undefined | PointStatus::boundary), 0u) << where;
      EXPECT_NEAR(p.mean[i], 0.5, 0.01) << where;
      // Where many points of the sphere are about as near, which one is told is open.
      if (glm::length(points[i]) < 0.5f) continue;
      EXPECT_LT(glm::distance(p.normal[i], expected.normal[i]), 1e-4f) << where;
      EXPECT_LT(glm::distance(p.normal[i], glm::normalize(points[i])), 0.1f) << where;
    }
  }
}

}  // namespace
}  // namespace smurf::test
