// Meshes: checks on construction, repairs, and what is asked of them.
#include "smurf/mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "meshes/builder.hpp"
#include "meshes/data.hpp"
#include "numerics/exact_sum.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

// Devices index with 32-bit integers: three corners a triangle.
constexpr std::uint64_t most_faces = std::numeric_limits<std::int32_t>::max() / 3;
constexpr std::uint64_t most_vertices = std::numeric_limits<std::int32_t>::max();

std::uint32_t hash(const glm::vec3& v) {
  const glm::vec3 p = v + 0.0f;  // 0 and -0 are equal
  const glm::uvec3 bits = glm::floatBitsToUint(p);
  std::uint64_t h = bits.x * 0x9e3779b97f4a7c15u + bits.y;
  h = (h ^ (h >> 29)) * 0xbf58476d1ce4e5b9u + bits.z;
  h = (h ^ (h >> 32)) * 0x94d049bb133111ebu;
  return std::uint32_t(h >> 32);
}

}  // namespace

std::string_view name_of(MeshOrientation orientation) {
  static constexpr std::string_view names[] = {"outward", "inward", "flat", "open", "mixed"};
  return names[std::size_t(orientation)];
}

bool has_no_area(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  if (a == b || b == c || c == a) return true;
  // Twice the area's components in double; each of the six products has an error of 2^-53 and stands in a sum of
  // differences, so that a component beyond the bound is not zero.
  const glm::dvec3 p = glm::dvec3(b) - glm::dvec3(a), q = glm::dvec3(c) - glm::dvec3(a);
  for (int x = 0; x < 3; x++) {
    const int y = (x + 1) % 3;
    if (std::abs(p[x] * q[y] - p[y] * q[x]) > 0x1p-49 * (std::abs(p[x] * q[y]) + std::abs(p[y] * q[x]))) return false;
  }
  for (int x = 0; x < 3; x++) {
    const int y = (x + 1) % 3;
    ExactSum<12> area;
    area.add_product(a[x], b[y]);
    area.add_product(-a[y], b[x]);
    area.add_product(b[x], c[y]);
    area.add_product(-b[y], c[x]);
    area.add_product(c[x], a[y]);
    area.add_product(-c[y], a[x]);
    if (area.sign() != 0) return false;
  }
  return true;
}

void MeshBuilder::fail(const std::string& message) const { throw Error(ErrorCode::input, origin_ + ": " + message); }

void MeshBuilder::check() const {
  const std::size_t vertices = polygons_.vertices.size();
  if (vertices == 0) fail("no vertices");
  if (polygons_.corners.empty()) fail(fmt::format("{} vertices, but no faces", vertices));
  if (vertices > most_vertices) fail(fmt::format("{} vertices; at most {} are possible", vertices, most_vertices));
  for (std::size_t i = 0; i < vertices; i++) {
    const glm::vec3& v = polygons_.vertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      fail(fmt::format("vertex {} is ({}, {}, {}); coordinates must be finite, and within ±3.4e38", i, v.x, v.y, v.z));
  }
  std::size_t corners = 0;
  for (const std::uint32_t size : polygons_.sizes) corners += size;
  if (polygons_.sizes.empty() ? polygons_.corners.size() % 3 != 0 : corners != polygons_.corners.size())
    fail(fmt::format("{} corners of faces were given, but the faces have {}", polygons_.corners.size(), corners));
  for (std::size_t i = 0; i < polygons_.corners.size(); i++) {
    if (polygons_.corners[i] < vertices) continue;
    std::size_t face = i / 3;
    if (!polygons_.sizes.empty()) {
      face = 0;
      for (std::size_t end = polygons_.sizes[0]; end <= i; end += polygons_.sizes[++face]) continue;
    }
    fail(fmt::format("face {} names vertex {}, but there are {} (0 to {})", face, polygons_.corners[i], vertices,
                     vertices - 1));
  }
}

// Each vertex becomes the first of those that are equal to it, found in a table of open addresses.
void MeshBuilder::weld() {
  constexpr std::uint32_t free = std::numeric_limits<std::uint32_t>::max();
  std::vector<glm::vec3>& vertices = polygons_.vertices;
  std::size_t slots = 16;
  while (slots < 2 * vertices.size()) slots *= 2;
  std::vector<std::uint32_t> table(slots, free), renamed(vertices.size());
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < vertices.size(); i++) {
    std::size_t slot = hash(vertices[i]) & (slots - 1);
    while (table[slot] != free && vertices[table[slot]] != vertices[i]) slot = (slot + 1) & (slots - 1);
    if (table[slot] == free) {
      table[slot] = kept;
      vertices[kept++] = vertices[i];
    }
    renamed[i] = table[slot];
  }
  repairs_.welded_vertices = vertices.size() - kept;
  vertices.resize(kept);
  for (std::uint32_t& corner : polygons_.corners) corner = renamed[corner];
}

void MeshBuilder::add_triangle(std::uint32_t face, const glm::uvec3& triangle) {
  const std::vector<glm::vec3>& v = polygons_.vertices;
  if (triangle.x == triangle.y || triangle.y == triangle.z || triangle.z == triangle.x) {
    repairs_.repeated_corners++;
  } else if (has_no_area(v[triangle.x], v[triangle.y], v[triangle.z])) {
    repairs_.zero_area++;
  } else {
    faces_.push_back(triangle);
    source_faces_.push_back(face);
  }
}

void MeshBuilder::add_face(std::uint32_t face, const std::uint32_t* corners, std::size_t size) {
  if (size < 3) {
    repairs_.small_faces++;
    return;
  }
  if (size == 3) {
    add_triangle(face, {corners[0], corners[1], corners[2]});
    return;
  }
  if (size > most_corners)
    fail(fmt::format("face {} has {} corners; at most {} are possible", face, size, most_corners));
  repairs_.polygons_split++;
  std::vector<glm::dvec3> places(size);
  std::vector<glm::uvec3> triangles;
  for (std::size_t i = 0; i < size; i++) places[i] = glm::dvec3(polygons_.vertices[corners[i]]);
  split_polygon(places, triangles);
  for (const glm::uvec3& t : triangles) add_triangle(face, {corners[t.x], corners[t.y], corners[t.z]});
}

void MeshBuilder::fail_empty(std::uint64_t face_count) const {
  fail(fmt::format(
      "no triangle is left of {} faces: {} have less than three corners, {} triangles name a vertex twice, {} "
      "have zero area",
      face_count, repairs_.small_faces, repairs_.repeated_corners, repairs_.zero_area));
}

Mesh MeshBuilder::build(Polygons polygons, const MeshOptions& options, const std::string& origin) {
  MeshBuilder builder(polygons, origin);
  builder.check();
  if (options.weld) builder.weld();
  const bool triangles = polygons.sizes.empty();
  const std::size_t face_count = triangles ? polygons.corners.size() / 3 : polygons.sizes.size();
  const std::uint64_t most = triangles ? face_count : std::uint64_t(polygons.corners.size());
  if (most > most_faces)
    builder.fail(fmt::format("{} corners of faces; at most {} are possible", 3 * most, 3 * most_faces));
  builder.faces_.reserve(face_count);
  builder.source_faces_.reserve(face_count);
  const std::uint32_t* corners = polygons.corners.data();
  for (std::size_t face = 0; face < face_count; face++) {
    const std::size_t size = triangles ? 3 : polygons.sizes[face];
    builder.add_face(std::uint32_t(face), corners, size);
    corners += size;
  }
  if (builder.faces_.empty()) builder.fail_empty(face_count);
  polygons.corners = {};

  const auto data = std::make_shared<Mesh::Data>();
  data->lower = data->upper = polygons.vertices[builder.faces_[0].x];
  std::vector<bool> used(polygons.vertices.size());
  for (const glm::uvec3& face : builder.faces_) {
    for (int k = 0; k < 3; k++) {
      used[face[k]] = true;
      data->lower = glm::min(data->lower, polygons.vertices[face[k]]);
      data->upper = glm::max(data->upper, polygons.vertices[face[k]]);
    }
  }
  builder.repairs_.unreferenced_vertices = std::uint64_t(std::ranges::count(used, false));
  builder.repairs_.ignored_elements = polygons.ignored_elements;
  data->repairs = builder.repairs_;
  data->source_face_count = face_count;
  data->vertices = std::move(polygons.vertices);
  data->faces = std::move(builder.faces_);
  data->source_faces = std::move(builder.source_faces_);
  return Mesh(data);
}

Mesh make_mesh(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces, const MeshOptions& options) {
  Polygons polygons{{vertices.begin(), vertices.end()}, {}, {}, 0};
  polygons.corners.reserve(3 * faces.size());
  for (const glm::uvec3& face : faces) polygons.corners.insert(polygons.corners.end(), {face.x, face.y, face.z});
  return MeshBuilder::build(std::move(polygons), options, "mesh");
}

Mesh make_mesh(std::span<const glm::vec3> vertices, std::span<const std::uint32_t> corners,
               std::span<const std::uint32_t> sizes, const MeshOptions& options) {
  if (sizes.empty() && !corners.empty())
    throw Error(ErrorCode::input, fmt::format("mesh: {} corners of faces, but no sizes of faces", corners.size()));
  return MeshBuilder::build(
      {{vertices.begin(), vertices.end()}, {corners.begin(), corners.end()}, {sizes.begin(), sizes.end()}, 0}, options,
      "mesh");
}

std::span<const glm::vec3> Mesh::vertices() const { return data_->vertices; }
std::span<const glm::uvec3> Mesh::faces() const { return data_->faces; }
std::span<const std::uint32_t> Mesh::source_faces() const { return data_->source_faces; }
std::uint64_t Mesh::source_face_count() const { return data_->source_face_count; }
const MeshRepairs& Mesh::repairs() const { return data_->repairs; }
glm::vec3 Mesh::lower() const { return data_->lower; }
glm::vec3 Mesh::upper() const { return data_->upper; }

std::size_t Mesh::bytes() const {
  return data_->vertices.size() * sizeof(glm::vec3) +
         data_->faces.size() * (sizeof(glm::uvec3) + sizeof(std::uint32_t));
}

const MeshTopology& Mesh::topology() const {
  MeshFacts& facts = *data_->facts;
  std::call_once(facts.found,
                 [&] { find_topology(data_->vertices, data_->faces, facts.topology, facts.vertex_states); });
  return facts.topology;
}

std::span<const std::uint8_t> Mesh::vertex_states() const {
  topology();
  return data_->facts->vertex_states;
}

}  // namespace smurf
