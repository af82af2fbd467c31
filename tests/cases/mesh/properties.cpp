// Normals and curvature of meshes, and their nearest points, on every device: against closed forms first, and as to
// statuses and nearest points against the reference.
//
// Order of convergence: where triangles lie regularly errors fall with the square of the edges' length; where they do
// not, with the length itself (differences of normals that are right to the square of it, divided by it).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "device/executor.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/kernel_cover.hpp"
#include "reference/mesh/brute_force.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/surface_definition.hpp"
#include "truth/meshes.hpp"

KERNELS(mesh_fans, mesh_rings, mesh_normals, mesh_tensors, find_nearest, measure);

namespace smurf::test {
namespace {

using glm::dvec3;
using Places = std::vector<SurfaceCoordinates>;

constexpr double pi = std::numbers::pi;
constexpr std::uint32_t all =
    Property::normal | Property::gauss | Property::mean | Property::principal | Property::directions;

dvec3 location(const Mesh& mesh, const SurfaceCoordinates& at) {
  const glm::uvec3& f = mesh.faces()[at.part];
  const dvec3 a(mesh.vertices()[f.x]), b(mesh.vertices()[f.y]), c(mesh.vertices()[f.z]);
  return a + double(at.u) * (b - a) + double(at.v) * (c - a);
}

double area(const Mesh& mesh, std::size_t face) {
  const glm::uvec3& f = mesh.faces()[face];
  const dvec3 a(mesh.vertices()[f.x]), b(mesh.vertices()[f.y]), c(mesh.vertices()[f.z]);
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

// The middle of each triangle.
Places middles(const Mesh& mesh) {
  Places places;
  for (std::uint32_t face = 0; face < mesh.face_count(); face++) places.push_back({face, 0.3125f, 0.3125f});
  return places;
}

// Each vertex, as a corner of one of its triangles.
Places vertices(const Mesh& mesh) {
  Places places;
  std::vector<bool> done(mesh.vertex_count());
  for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
    for (int k = 0; k < 3; k++) {
      const std::uint32_t vertex = mesh.faces()[face][k];
      if (!done[vertex]) places.push_back({face, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f});
      done[vertex] = true;
    }
  }
  return places;
}

Places all_places(const Mesh& mesh) {
  Places places = vertices(mesh);
  for (const SurfaceCoordinates& c : middles(mesh)) places.push_back(c);
  for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
    places.push_back({face, 0.5f, 0.0f});
    places.push_back({face, 0.25f, 0.75f});
  }
  return places;
}

PointProperties measure_at(SurfaceQueries& query, const Mesh& mesh, const Places& places, std::uint32_t wanted = all) {
  std::vector<glm::vec3> locations;
  for (const SurfaceCoordinates& at : places) locations.emplace_back(location(mesh, at));
  PointProperties out;
  query.measure({locations, places, {}}, wanted, {}, out);
  return out;
}
PointProperties measure_at(const TestDevice& device, const Mesh& mesh, MeshNormals normals, const Places& places) {
  return measure_at(*interrogate_on_device(device.device, mesh_surface(mesh, normals).share()), mesh, places);
}

// ---- Against closed forms

using Truth = MeshTruth;
using TruthAt = std::function<Truth(const dvec3&)>;
using Inside = std::function<bool(const dvec3&)>;

// Greatest errors; curvatures relative to the greater principal curvature.
struct Errors {
  double normal = 0, mean = 0, gauss = 0, k1 = 0, k2 = 0, direction = 0, frame = 0, sum = 0;
  std::size_t count = 0;
};

Errors errors_of(const Mesh& mesh, const Places& places, const PointProperties& p, const TruthAt& truth,
                 const Inside& inside) {
  Errors worst;
  const auto widen = [](double& error, double value) {
    error = std::isnan(value) ? std::numeric_limits<double>::infinity() : std::max(error, std::abs(value));
  };
  for (std::size_t i = 0; i < places.size(); i++) {
    const dvec3 at = location(mesh, places[i]);
    if (!inside(at)) continue;
    const Truth t = truth(at);
    const double k1 = p.k1[i], k2 = p.k2[i], size = std::max(std::abs(t.k1), std::abs(t.k2));
    const dvec3 n(p.normal[i]), d1(p.d1[i]), d2(p.d2[i]);
    widen(worst.normal, glm::distance(n, t.normal));
    widen(worst.k1, (k1 - t.k1) / size);
    widen(worst.k2, (k2 - t.k2) / size);
    widen(worst.mean, (p.mean[i] - 0.5 * (t.k1 + t.k2)) / size);
    widen(worst.gauss, (p.gauss[i] - t.k1 * t.k2) / (size * size));
    if (t.d1 != dvec3(0.0)) widen(worst.direction, 1 - std::abs(glm::dot(d1, t.d1)));
    // What must hold to rounding: unit vectors at right angles, k1 >= k2, and both means of telling the same.
    widen(worst.frame, glm::length(n) - 1);
    widen(worst.frame, glm::length(d1) - 1);
    widen(worst.frame, glm::dot(n, d1));
    widen(worst.frame, glm::dot(n, d2));
    widen(worst.frame, glm::dot(d1, d2));
    widen(worst.frame, std::min(0.0, (k1 - k2) / size));
    widen(worst.frame, (p.mean[i] - 0.5 * (k1 + k2)) / size);
    widen(worst.frame, (p.gauss[i] - k1 * k2) / (size * size));
    worst.sum += std::pow((p.mean[i] - 0.5 * (t.k1 + t.k2)) / size, 2);
    worst.count++;
  }
  return worst;
}

Truth sphere_truth(double radius, const dvec3& p) { return {glm::normalize(p), 1 / radius, 1 / radius, dvec3(0.0)}; }

// z = 2x² + y², normals upwards.
Truth paraboloid_truth(const dvec3& p) {
  const double fx = 4 * p.x, fy = 2 * p.y, w = std::sqrt(1 + fx * fx + fy * fy);
  const double gauss = 8 / std::pow(w, 4), mean = -((1 + fy * fy) * 4 + (1 + fx * fx) * 2) / (2 * w * w * w);
  const double radius = std::sqrt(std::max(0.0, mean * mean - gauss));
  return {dvec3(-fx, -fy, 1) / w, mean + radius, mean - radius, dvec3(0.0)};
}

TEST(MeshProperties, SphereOfData) {
  if (!has_shared_data("meshes")) GTEST_SKIP();
  const Mesh mesh = load_mesh(shared_data("meshes/cgal_sphere966.off"));
  const TruthAt truth = [](const dvec3& p) { return sphere_truth(10, p); };
  const Places places = all_places(mesh);
  for (const TestDevice& device : test_devices()) {
    for (const MeshNormals normals : {MeshNormals::face, MeshNormals::interpolated}) {
      const Errors e = errors_of(mesh, places, measure_at(device, mesh, normals, places), truth, everywhere);
      std::cerr << "  " << device.label << ": mean " << e.mean << ", gauss " << e.gauss << ", normal " << e.normal
                << "\n";
      EXPECT_LT(e.mean, 0.02) << device.label;
      EXPECT_LT(e.gauss, 0.02) << device.label;
      EXPECT_LT(e.normal, normals == MeshNormals::face ? 0.11 : 0.02) << device.label;
      EXPECT_LT(e.frame, 2e-6) << device.label;
    }
  }
}

// 33 × 33 vertices with curvature up to 4; inside, three rings from the border and more. The measured worst is 2.4e-2,
// at the apex, where an edge is a quarter of the radius of curvature.
TEST(MeshProperties, Paraboloid) {
  if (!has_shared_data("meshes")) GTEST_SKIP();
  const Mesh mesh = load_mesh(shared_data("meshes/cgal_poly2x2+y2-0.0625.off"));
  const Inside inside = [](const dvec3& p) { return std::max(std::abs(p.x), std::abs(p.y)) < 1 - 3.0 / 16; };
  const Places places = vertices(mesh);
  for (const TestDevice& device : test_devices()) {
    const Errors e =
        errors_of(mesh, places, measure_at(device, mesh, MeshNormals::interpolated, places), paraboloid_truth, inside);
    std::cerr << "  " << device.label << ": mean " << e.mean << ", gauss " << e.gauss << ", normal " << e.normal
              << "\n";
    EXPECT_GT(e.count, 600u);
    EXPECT_LT(e.mean, 0.025) << device.label;
    EXPECT_LT(e.gauss, 0.025) << device.label;
    EXPECT_LT(e.frame, 2e-6) << device.label;
  }
}

// A torus with its vertices moved at random by up to a fifth of a cell along it.
Mesh uneven_torus(std::uint32_t around, std::uint32_t across) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  std::vector<glm::vec3> points;
  std::vector<glm::uvec3> faces;
  for (std::uint32_t i = 0; i < around; i++) {
    for (std::uint32_t j = 0; j < across; j++) {
      const double u = 2 * pi * (i + uniform(random)) / around, v = 2 * pi * (j + uniform(random)) / across;
      points.emplace_back((3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u), std::sin(v));
    }
  }
  const Mesh even = torus_mesh(3, 1, around, across);
  return make_mesh(points, even.faces());
}

TEST(MeshProperties, FinerAndFinerMeshes) {
  struct Kind {
    std::string name;
    std::function<Mesh(std::uint32_t)> mesh;
    TruthAt truth;
    Inside inside;
    double falls;  // by at least this factor as edges are halved
    double least;  // what the finest reaches
  };
  const Kind kinds[] = {
      {"sphere", [](std::uint32_t n) { return sphere_mesh(2, n == 16   ? 3
                                                             : n == 32 ? 4
                                                                       : 5); },
       [](const dvec3& p) { return sphere_truth(2, p); }, everywhere, 3.3, 1e-3},
      {"cylinder", [](std::uint32_t n) { return cylinder_mesh(2, 3, 2 * n, n); },
       [](const dvec3& p) {
         const dvec3 n = glm::normalize(dvec3(p.x, p.y, 0));
         return Truth{n, 0.5, 0, dvec3(-n.y, n.x, 0)};
       },
       [](const dvec3& p) { return p.z > 0.7 && p.z < 2.3; }, 3.3, 2e-3},
      {"torus", [](std::uint32_t n) { return torus_mesh(3, 1, 3 * n, n); },
       [](const dvec3& p) { return torus_truth(3, 1, p); }, everywhere, 3.3, 2e-3},
      {"uneven torus", [](std::uint32_t n) { return uneven_torus(3 * n, n); },
       [](const dvec3& p) { return torus_truth(3, 1, p); }, everywhere, 1.8, 0.02},
  };
  for (const TestDevice& device : test_devices()) {
    for (const Kind& kind : kinds) {
      Errors last;
      for (const std::uint32_t n : {16u, 32u, 64u}) {
        if (device.slow && n == 64) continue;
        const Mesh mesh = kind.mesh(n);
        const Places places = vertices(mesh);
        const Errors e = errors_of(mesh, places, measure_at(device, mesh, MeshNormals::interpolated, places),
                                   kind.truth, kind.inside);
        const std::string where = kind.name + " " + std::to_string(n) + ", " + device.label;
        std::cerr << "  " << where << ": k1 " << e.k1 << ", k2 " << e.k2 << ", mean " << e.mean << " (rms "
                  << std::sqrt(e.sum / double(e.count)) << "), gauss " << e.gauss << ", direction " << e.direction
                  << "\n";
        EXPECT_GT(e.count, 200u) << where;
        EXPECT_LT(e.frame, 2e-6) << where;
        if (n > 16) {
          // What rounding leaves of differences of normals grows as edges shrink: 2^-24 per edge and curvature, and a
          // few of it.
          const double floor = 0x1p-20 * n;
          EXPECT_LT(std::sqrt(e.sum / double(e.count)),
                    std::max(std::sqrt(last.sum / double(last.count)) / kind.falls, floor))
              << where;
          EXPECT_LT(e.k1, std::max(last.k1 / (kind.falls * 0.8), floor)) << where;
        }
        if (n == 64) {
          EXPECT_LT(std::max({e.k1, e.k2, e.mean, e.gauss}), kind.least) << where;
          EXPECT_LT(e.direction, 1e-3) << where;
        }
        last = e;
      }
    }
  }
}

// The integral of K over the triangles, by the rule of three points in each that is exact up to degree 2.
double total_gauss(const TestDevice& device, const Mesh& mesh) {
  Places places;
  for (std::uint32_t face = 0; face < mesh.face_count(); face++)
    for (const int k : {0, 1, 2}) places.push_back({face, k == 1 ? 2.0f / 3 : 1.0f / 6, k == 2 ? 2.0f / 3 : 1.0f / 6});
  const PointProperties p = measure_at(device, mesh, MeshNormals::interpolated, places);
  double sum = 0;
  for (std::size_t i = 0; i < places.size(); i++) sum += double(p.gauss[i]) * area(mesh, places[i].part) / 3;
  return sum;
}

// By Gauss and Bonnet the integral over a closed surface is 2π·χ. The vertices' angle defects add up to it on every
// mesh; tensors describe a smooth surface near the mesh, with areas that are the triangles', and add up to it in the
// limit only: the difference falls with the square of the edges' length (the area of an inscribed sphere alone is short
// by as much). It reaches a thousandth where an edge is a twentieth of the radius of curvature.
TEST(MeshProperties, GaussBonnet) {
  for (const TestDevice& device : one_of_each()) {
    if (device.name == "reference") continue;
    const auto part_missing = [&](const std::string& name, const Mesh& mesh, double whole) {
      const double truth = 2 * pi * double(mesh.topology().euler_characteristic), total = total_gauss(device, mesh);
      std::cerr << "  " << device.label << ", " << name << ": " << total << " of " << truth << "\n";
      return std::abs(total - truth) / whole;
    };
    const double ball = 4 * pi, ring = 8 * pi;  // the integrals of |K|
    if (has_shared_data("meshes")) {
      const double of_data = part_missing("sphere of data", load_mesh(shared_data("meshes/cgal_sphere966.off")), ball);
      EXPECT_LT(of_data, 5e-3);
    }
    const double coarse = part_missing("sphere 4", sphere_mesh(1, 4), ball),
                 fine = part_missing("sphere 5", sphere_mesh(1, 5), ball);
    EXPECT_LT(coarse, 4e-3);
    EXPECT_LT(fine, 1e-3);
    EXPECT_LT(fine, coarse / 3.5);
    const double thick = part_missing("torus 32", torus_mesh(3, 1, 96, 32), ring),
                 thin = part_missing("torus 72", torus_mesh(3, 1, 216, 72), ring);
    EXPECT_LT(thin, 1e-3);
    EXPECT_LT(thin, thick / 4);
  }
}

// The Gauss curvature measure of the vertex normals, K times area of the surface that they belong to: of each triangle
// the solid angle of its three normals (Lachaud, Romon, Thibert, Coeurjolly 2020; the angle by Van Oosterom and
// Strackee 1983).
double total_gauss_measure(const Mesh& mesh, const std::vector<dvec3>& normals) {
  double sum = 0;
  for (const glm::uvec3& face : mesh.faces()) {
    const dvec3 a = normals[face.x], b = normals[face.y], c = normals[face.z];
    sum += 2 * std::atan2(glm::dot(a, glm::cross(b, c)), 1 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
  }
  return sum;
}

// It adds up to 2π·χ on coarse meshes, too, as long as no triangle's normals are half a sphere apart.
TEST(MeshProperties, GaussBonnetOfNormals) {
  std::vector<std::pair<std::string, Mesh>> meshes;
  meshes.emplace_back("sphere 1", sphere_mesh(1, 1));
  meshes.emplace_back("sphere 4", sphere_mesh(1, 4));
  meshes.emplace_back("torus 12 x 5", torus_mesh(3, 1, 12, 5));
  meshes.emplace_back("torus 96 x 32", torus_mesh(3, 1, 96, 32));
  meshes.emplace_back("box", box_mesh(glm::vec3(0), glm::vec3(1), 7));
  if (has_shared_data("meshes")) {
    for (const std::string name :
         {"cgal_elephant.off", "cgal_ellipe0.003.off", "cgal_knot2.off", "cgal_sphere966.off", "libigl_bunny.off"})
      meshes.emplace_back(name, load_mesh(shared_data("meshes/" + name)));
  }
  for (const TestDevice& device : test_devices()) {
    for (const auto& [name, mesh] : meshes) {
      if (device.slow && mesh.vertex_count() > 2000) continue;
      ASSERT_TRUE(mesh.topology().closed) << name;
      const PointProperties p = vertex_properties(device.device, mesh, std::uint32_t(Property::normal));
      std::vector<dvec3> normals(p.normal.begin(), p.normal.end());
      for (dvec3& normal : normals) normal = glm::normalize(normal);
      const double truth = 2 * pi * double(mesh.topology().euler_characteristic),
                   total = total_gauss_measure(mesh, normals);
      EXPECT_NEAR(total, truth, 1e-3) << name << ", " << device.label;
    }
  }
}

// ---- Statuses, as the reference tells them

struct Named {
  std::string name;
  Mesh mesh;
};

std::vector<glm::uvec3> square_faces(std::uint32_t n) {
  std::vector<glm::uvec3> faces;
  for (std::uint32_t j = 0; j < n; j++) {
    for (std::uint32_t i = 0; i < n; i++) {
      const std::uint32_t a = (n + 1) * j + i;
      faces.insert(faces.end(), {{a, a + 1, a + n + 2}, {a, a + n + 2, a + n + 1}});
    }
  }
  return faces;
}

std::vector<glm::vec3> square_vertices(std::uint32_t n, const std::function<float(float, float)>& height) {
  std::vector<glm::vec3> points;
  for (std::uint32_t j = 0; j <= n; j++) {
    for (std::uint32_t i = 0; i <= n; i++) points.emplace_back(i, j, height(float(i), float(j)));
  }
  return points;
}

std::vector<Named> awkward_meshes() {
  std::vector<Named> list;
  const auto bent = [](float x, float y) { return 0.125f * x * x - 0.0625f * x * y; };
  // A square with a fin: an edge of three triangles.
  std::vector<glm::vec3> points = square_vertices(8, bent);
  std::vector<glm::uvec3> faces = square_faces(8);
  points.emplace_back(4.5f, 4.5f, 9.0f);
  faces.emplace_back(4 * 9 + 4, 4 * 9 + 5, 81);
  list.push_back({"fin", make_mesh(points, faces)});
  // Two sheets that touch at a vertex.
  points = square_vertices(4, bent);
  faces = square_faces(4);
  for (const glm::vec3& p : square_vertices(4, bent)) points.emplace_back(-p.x, -p.y, 1 + p.z);
  for (const glm::uvec3& f : square_faces(4)) faces.push_back(f + 25u);
  for (glm::uvec3& f : faces) {
    for (int k = 0; k < 3; k++)
      if (f[k] == 25) f[k] = 0;
  }
  list.push_back({"sheets that touch", make_mesh(points, faces)});
  // Both sides of one sheet: normals cancel inside and at the border.
  faces = square_faces(4);
  for (const glm::uvec3& f : square_faces(4)) faces.emplace_back(f.x, f.z, f.y);
  list.push_back({"two-sided sheet", make_mesh(square_vertices(4, bent), faces)});
  // Too few points for a quadric, or on a conic.
  list.push_back({"tetrahedron", make_mesh(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                           std::vector<glm::uvec3>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}})});
  list.push_back({"octahedron", sphere_mesh(1, 0)});
  list.push_back({"box of twelve triangles", box_mesh({0, 0, 0}, {1, 2, 3}, 1)});
  points.clear();
  faces.clear();
  for (std::uint32_t i = 0; i < 12; i++) {
    points.emplace_back(i, i % 2, 0);
    if (i >= 2) faces.push_back(i % 2 == 0 ? glm::uvec3(i - 2, i, i - 1) : glm::uvec3(i - 2, i - 1, i));
  }
  list.push_back({"strip between two lines", make_mesh(points, faces)});
  list.push_back({"one triangle", make_mesh(std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                            std::vector<glm::uvec3>{{0, 1, 2}})});
  // A fan: one vertex with many neighbours.
  points.assign(1, {0, 0, 1});
  faces.clear();
  for (std::uint32_t i = 0; i < 100; i++) {
    points.emplace_back(std::cos(0.06 * i), std::sin(0.06 * i), 0.01f * float(i % 3));
    if (i > 0) faces.emplace_back(0, i, i + 1);
  }
  list.push_back({"fan", make_mesh(points, faces)});
  list.push_back({"sphere", sphere_mesh(2, 2)});
  list.push_back({"cylinder", cylinder_mesh(1, 2, 16, 8)});
  list.push_back({"box", box_mesh({-1, -1, -1}, {1, 1, 1}, 4)});
  return list;
}

TEST(MeshProperties, StatusesAreTheReferences) {
  std::size_t undefined = 0, boundary = 0, without_normal = 0;
  for (const auto& [name, mesh] : awkward_meshes()) {
    const Places places = all_places(mesh);
    for (const MeshNormals normals : {MeshNormals::face, MeshNormals::interpolated}) {
      const Surface surface = mesh_surface(mesh, normals);
      const PointProperties expected = measure_at(*interrogate_by_reference(surface.model()), mesh, places);
      for (const TestDevice& device : test_devices()) {
        const PointProperties found = measure_at(device, mesh, normals, places);
        for (std::size_t i = 0; i < places.size(); i++) {
          const std::string where = name + ", " + device.label + ", triangle " + std::to_string(places[i].part) +
                                    " at " + std::to_string(places[i].u) + ", " + std::to_string(places[i].v);
          // Whether the two estimates of curvature are umbilic is another question (FlatMeshes).
          const std::uint32_t shared = ~std::uint32_t(PointStatus::umbilic);
          ASSERT_EQ(found.status[i] & shared, expected.status[i] & shared)
              << where << ": k " << found.k1[i] << ", " << found.k2[i] << ", expected " << expected.k1[i] << ", "
              << expected.k2[i];
          const bool curved = (expected.status[i] & PointStatus::undefined) == 0;
          for (const float value :
               {found.k1[i], found.k2[i], found.mean[i], found.gauss[i], found.d1[i].x, found.d2[i].z})
            ASSERT_EQ(std::isnan(value), !curved) << where;
          const bool has_normal = !std::isnan(expected.normal[i].x);
          ASSERT_EQ(!std::isnan(found.normal[i].x), has_normal) << where;
          if (has_normal) {
            ASSERT_LT(glm::distance(found.normal[i], expected.normal[i]), 2e-6f) << where;
          }
          undefined += !curved;
          boundary += (found.status[i] & PointStatus::boundary) != 0;
          without_normal += !has_normal;
        }
      }
    }
  }
  EXPECT_GT(undefined, 100u);
  EXPECT_GT(boundary, 1000u);
  EXPECT_GT(without_normal, 10u);
}

// A plane has no curvature and no principal directions, whichever way it lies.
TEST(MeshProperties, FlatMeshes) {
  const auto level = [](float, float) { return 0.0f; };
  const auto tilted = [](float x, float y) { return 0.3f * x - 1.7f * y + 100; };
  for (const TestDevice& device : test_devices()) {
    for (const bool is_tilted : {false, true}) {
      const Mesh mesh = make_mesh(is_tilted ? square_vertices(8, tilted) : square_vertices(8, level), square_faces(8));
      const Places places = all_places(mesh);
      for (const MeshNormals normals : {MeshNormals::face, MeshNormals::interpolated}) {
        const PointProperties p = measure_at(device, mesh, normals, places),
                              expected = measure_at(*interrogate_by_reference(mesh_surface(mesh, normals).model()),
                                                    mesh, places);
        for (std::size_t i = 0; i < places.size(); i++) {
          ASSERT_NE(p.status[i] & PointStatus::umbilic, 0u) << device.label << ", " << i << ": " << p.k1[i] - p.k2[i];
          ASSERT_EQ(p.status[i], expected.status[i]) << device.label << ", " << i;
          // Heights near 100 are floats, a few millionths off the plane.
          ASSERT_NEAR(p.mean[i], 0, is_tilted ? 2e-5 : 1e-7) << device.label << ", " << i;
        }
      }
    }
  }
}

// The same shape anywhere and at any size: curvature by the inverse of the size.
TEST(MeshProperties, PlacesAndSizes) {
  const Mesh mesh = torus_mesh(3, 1, 48, 16);
  const Places places = middles(mesh);
  for (const TestDevice& device : one_of_each()) {
    if (device.name == "reference") continue;
    const PointProperties expected = measure_at(device, mesh, MeshNormals::interpolated, places);
    for (const double size : {1e-12, 3e-3, 7.0, 1e12}) {
      const PointProperties p =
          measure_at(device, placed(mesh, size, size * dvec3(5, -3, 2)), MeshNormals::interpolated, places);
      for (std::size_t i = 0; i < places.size(); i++) {
        ASSERT_NEAR(p.k1[i] * size, expected.k1[i], 1e-3) << device.label << ", size " << size;
        ASSERT_NEAR(p.k2[i] * size, expected.k2[i], 1e-3) << device.label << ", size " << size;
      }
    }
  }
}

// A sphere as small and as large as floats go, of which is told what is told of the unit sphere: curvature that a float
// can tell is told, Gauss curvature that it cannot is infinite or 0, and where even curvatures are too great for a
// float nothing is told.
TEST(MeshProperties, ExtremeSizes) {
  const Mesh unit = sphere_mesh(1, 3);
  for (const double scale : {1e-37, 1e-30, 1e-18, 1e18, 1e30, 1e37}) {
    const Mesh mesh = placed(unit, scale, dvec3(0.0));
    const Places places = middles(mesh);
    for (const TestDevice& device : test_devices()) {
      SCOPED_TRACE(device.label + ", radius " + std::to_string(std::log10(scale)));
      const PointProperties p = measure_at(device, mesh, MeshNormals::interpolated, places),
                            q = measure_at(device, unit, MeshNormals::interpolated, places);
      double normal = 0, mean = 0, change = 0, frame = 0;
      std::size_t undefined = 0, gauss = 0;
      for (std::size_t i = 0; i < places.size(); i++) {
        normal = std::max(normal, glm::distance(dvec3(p.normal[i]), dvec3(q.normal[i])));
        change = std::max({change, std::abs(p.k1[i] * scale - q.k1[i]), std::abs(p.k2[i] * scale - q.k2[i])});
        mean = std::max(mean, std::abs(p.mean[i] * scale - 1));
        mean = std::max(mean, std::abs(0.5 * scale * (double(p.k1[i]) + p.k2[i]) - 1));
        frame = std::max(frame, double(std::abs(glm::dot(p.normal[i], p.d1[i]))));
        undefined += (p.status[i] & PointStatus::undefined) != 0;
        const float square = float(1 / (scale * scale));
        const bool right = std::isinf(square) ? p.gauss[i] == square
                           : square < 1e-37f  ? p.gauss[i] >= 0 && p.gauss[i] < 1e-37f
                                              : std::abs(p.gauss[i] / square - 1) < 0.05;
        gauss += !right;
      }
      // Vertices are rounded anew: 6e-8 of the radius, where edges are an eighth of it; curvatures divide by their
      // square.
      EXPECT_LT(normal, 2e-6);
      EXPECT_LT(change, 2e-5);
      EXPECT_LT(mean, 0.02);
      EXPECT_LT(frame, 1e-6);
      EXPECT_EQ(undefined, 0u);
      EXPECT_EQ(gauss, 0u);
    }
  }
  // Coordinates without leading digits, as far as they go; curvatures of 1e41.
  const Mesh least = placed(unit, 1e-41, dvec3(0.0));
  for (const TestDevice& device : test_devices()) {
    SCOPED_TRACE(device.label);
    const PointProperties p = measure_at(device, least, MeshNormals::face, middles(least));
    for (std::size_t i = 0; i < p.status.size(); i++) {
      ASSERT_EQ(p.status[i], PointStatus::undefined);
      ASSERT_TRUE(std::isnan(p.mean[i]) && std::isnan(p.k1[i]) && std::isnan(p.gauss[i]));
      ASSERT_NEAR(glm::length(p.normal[i]), 1, 1e-5);
    }
  }
}

// All vertices at once: what points at corners of triangles have, and the reference's statuses.
TEST(MeshProperties, AllVertices) {
  std::vector<Named> meshes = awkward_meshes();
  // A vertex of no triangle.
  std::vector<glm::vec3> points = square_vertices(4, [](float x, float y) { return 0.1f * x * y; });
  points.emplace_back(9, 9, 9);
  meshes.push_back({"lone vertex", make_mesh(points, square_faces(4))});
  std::size_t curved = 0;
  for (const auto& [name, mesh] : meshes) {
    std::vector<SurfaceCoordinates> corner(mesh.vertex_count(), {~0u, 0, 0});
    for (const SurfaceCoordinates& at : vertices(mesh))
      corner[mesh.faces()[at.part][at.u == 1 ? 1 : at.v == 1 ? 2 : 0]] = at;
    const PointProperties expected = vertex_properties(open_device("reference"), mesh, all);
    ASSERT_EQ(expected.status.size(), mesh.vertex_count());
    for (const TestDevice& device : test_devices()) {
      const PointProperties found = vertex_properties(device.device, mesh, all);
      ASSERT_EQ(found.k1.size(), mesh.vertex_count());
      for (std::size_t v = 0; v < mesh.vertex_count(); v++) {
        const std::string where = name + ", " + device.label + ", vertex " + std::to_string(v);
        const std::uint32_t shared = ~std::uint32_t(PointStatus::umbilic);
        ASSERT_EQ(found.status[v] & shared, expected.status[v] & shared) << where;
        ASSERT_EQ(std::isnan(found.normal[v].x), std::isnan(expected.normal[v].x)) << where;
        if (corner[v].part == ~0u) {
          ASSERT_EQ(found.status[v], PointStatus::undefined) << where;
          continue;
        }
        if (std::isnan(found.k1[v])) continue;
        curved++;
      }
      const Places places = vertices(mesh);
      const PointProperties at_corners = measure_at(device, mesh, MeshNormals::interpolated, places);
      for (std::size_t i = 0; i < places.size(); i++) {
        const SurfaceCoordinates& at = places[i];
        const std::size_t v = mesh.faces()[at.part][at.u == 1 ? 1 : at.v == 1 ? 2 : 0];
        if (std::isnan(at_corners.k1[i])) continue;
        const float size = std::max({std::abs(at_corners.k1[i]), std::abs(at_corners.k2[i]), 1e-3f});
        ASSERT_NEAR(found.k1[v], at_corners.k1[i], 1e-5f * size) << name << ", " << device.label;
        ASSERT_NEAR(found.k2[v], at_corners.k2[i], 1e-5f * size) << name << ", " << device.label;
        ASSERT_LT(glm::distance(found.normal[v], at_corners.normal[i]), 1e-6f) << name << ", " << device.label;
      }
    }
  }
  EXPECT_GT(curved, 500u);
  EXPECT_THROW(vertex_properties(open_device("reference"), meshes[0].mesh, std::uint32_t(Property::value)), Error);
}

}  // namespace
}  // namespace smurf::test
