#include "truth/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <vector>

namespace smurf::test {
namespace {

constexpr double pi = std::numbers::pi;

// Two triangles; corners counter-clockwise.
void add_quadrilateral(std::vector<glm::uvec3>& faces, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                       std::uint32_t d) {
  faces.emplace_back(a, b, c);
  faces.emplace_back(a, c, d);
}

}  // namespace

Mesh torus_mesh(double great, double small, std::uint32_t around, std::uint32_t across) {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  vertices.reserve(std::size_t(around) * across);
  faces.reserve(2 * std::size_t(around) * across);
  for (std::uint32_t i = 0; i < around; i++) {
    const double u = 2 * pi * i / around, cu = std::cos(u), su = std::sin(u);
    for (std::uint32_t j = 0; j < across; j++) {
      const double v = 2 * pi * j / across, r = great + small * std::cos(v);
      vertices.emplace_back(r * cu, r * su, small * std::sin(v));
      const std::uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      add_quadrilateral(faces, i * across + j, i1 * across + j, i1 * across + j1, i * across + j1);
    }
  }
  return make_mesh(vertices, faces);
}

Mesh slanted_strips(std::uint32_t count) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  for (std::uint32_t i = 0; i < count; i++) {
    const glm::vec3 from = {2 * uniform(random), uniform(random), uniform(random)};
    const glm::vec3 along = {1 + 0.2f * uniform(random), 1, 1 + 0.2f * uniform(random)};
    vertices.insert(vertices.end(), {from, from + glm::vec3(0.003f, 0, 0), from + along});
    faces.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return make_mesh(vertices, faces);
}

Mesh sphere_mesh(double radius, int levels, const glm::dvec3& centre) {
  std::vector<glm::dvec3> points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<glm::uvec3> faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                   {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; level++) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), std::uint32_t(points.size()));
      if (is_new) points.push_back(glm::normalize(points[a] + points[b]));
      return at->second;
    };
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& f : faces) {
      const std::uint32_t a = middle(f.x, f.y), b = middle(f.y, f.z), c = middle(f.z, f.x);
      finer.insert(finer.end(), {{f.x, a, c}, {f.y, b, a}, {f.z, c, b}, {a, b, c}});
    }
    faces = std::move(finer);
  }
  std::vector<glm::vec3> vertices;
  for (const glm::dvec3& p : points) vertices.emplace_back(centre + radius * p);
  return make_mesh(vertices, faces);
}

Mesh cylinder_mesh(double radius, double height, std::uint32_t around, std::uint32_t along) {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  for (std::uint32_t k = 0; k <= along; k++) {
    for (std::uint32_t i = 0; i < around; i++) {
      const double u = 2 * pi * i / around;
      vertices.emplace_back(radius * std::cos(u), radius * std::sin(u), height * k / along);
      const std::uint32_t i1 = (i + 1) % around;
      if (k < along)
        add_quadrilateral(faces, k * around + i, k * around + i1, (k + 1) * around + i1, (k + 1) * around + i);
    }
  }
  return make_mesh(vertices, faces);
}

Mesh box_mesh(const glm::vec3& lower, const glm::vec3& upper, std::uint32_t cells) {
  std::vector<glm::vec3> vertices;
  std::vector<std::uint32_t> corners, sizes;
  for (int axis = 0; axis < 3; axis++) {
    for (const bool top : {false, true}) {
      const int u = (axis + (top ? 1 : 2)) % 3, v = 3 - axis - u;
      const auto first = std::uint32_t(vertices.size());
      for (std::uint32_t j = 0; j <= cells; j++) {
        for (std::uint32_t i = 0; i <= cells; i++) {
          glm::vec3 p;
          p[axis] = top ? upper[axis] : lower[axis];
          p[u] = i == cells ? upper[u] : lower[u] + (upper[u] - lower[u]) * float(i) / float(cells);
          p[v] = j == cells ? upper[v] : lower[v] + (upper[v] - lower[v]) * float(j) / float(cells);
          vertices.push_back(p);
          if (i == cells || j == cells) continue;
          const std::uint32_t a = first + j * (cells + 1) + i, above = a + cells + 1;
          corners.insert(corners.end(), {a, a + 1, above + 1, above});
          sizes.push_back(4);
        }
      }
    }
  }
  return make_mesh(vertices, corners, sizes, {.weld = true});
}

MeshTruth torus_truth(double great, double small, const glm::dvec3& p) {
  const double r = std::hypot(p.x, p.y);
  const glm::dvec3 spoke(p.x / r, p.y / r, 0), normal = glm::normalize(p - great * spoke);
  const glm::dvec3 around(-spoke.y, spoke.x, 0);
  return {normal, 1 / small, glm::dot(normal, spoke) / (great + small * glm::dot(normal, spoke)),
          glm::cross(normal, around)};
}

Mesh placed(const Mesh& mesh, double scale, const glm::dvec3& offset) {
  std::vector<glm::vec3> vertices;
  for (const glm::vec3& v : mesh.vertices()) vertices.emplace_back(scale * glm::dvec3(v) + offset);
  return make_mesh(vertices, mesh.faces());
}

}  // namespace smurf::test
