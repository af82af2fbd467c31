#include "surfaces/mesh/hierarchy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "kernels/mesh/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

// Lanes test as many as 16 triangles at the price of one, so that leaves of fewer are split no further: on the bunny
// such leaves have 11 triangles in the mean, where the builder would make half of its leaves of one triangle, and rays
// with all hits are faster by a tenth.
constexpr std::size_t fewest_to_split = 16;
constexpr float triangle_cost = 0.05f;  // of a node's
constexpr std::size_t most_parts = 4;   // of a triangle in the mean, where they are split
static_assert(MESH_LEAF_MOST <= bvh_most_in_leaf);

// The parts of a triangle on both sides of a plane across axis a, within `box`, which earlier splits may have left.
// Boxes hold all of the triangle that lies in them: where its edges cross the plane is calculated in double, and
// rounded outwards by more than that errs.
std::array<BvhBox, 2> split(const Mesh& mesh, float unit, std::uint32_t number, const BvhBox& box, int a, float at) {
  const glm::uvec3 face = mesh.faces()[number];
  std::array<glm::dvec3, 3> corners;
  for (int k = 0; k < 3; k++) corners[std::size_t(k)] = glm::dvec3(unit * mesh.vertices()[face[k]]);
  glm::dvec3 least[2], most[2];
  for (const int side : {0, 1}) {
    least[side] = glm::dvec3(std::numeric_limits<double>::max());
    most[side] = -least[side];
  }
  const auto add = [&](int side, const glm::dvec3& p) {
    least[side] = glm::min(least[side], p);
    most[side] = glm::max(most[side], p);
  };
  for (std::size_t k = 0; k < 3; k++) {
    const glm::dvec3 &from = corners[k], &to = corners[(k + 1) % 3];
    if (from[a] <= double(at)) add(0, from);
    if (from[a] >= double(at)) add(1, from);
    if ((from[a] < double(at) && to[a] > double(at)) || (from[a] > double(at) && to[a] < double(at))) {
      glm::dvec3 p = from + (to - from) * ((double(at) - from[a]) / (to[a] - from[a]));
      p[a] = double(at);
      add(0, p);
      add(1, p);
    }
  }
  std::array<BvhBox, 2> parts;
  for (const int side : {0, 1}) {
    glm::vec3 low = box.lower, high = box.upper;
    // Boxes are a little wider than triangles: a plane that passes beside the triangle leaves nothing on one side,
    // where the box is kept.
    const bool some = least[side].x <= most[side].x;
    for (int k = 0; some && k < 3; k++) {
      // From float's neighbours on either side: double errs by far less.
      low[k] = std::max(box.lower[k], std::nextafter(float(least[side][k]), -std::numeric_limits<float>::max()));
      high[k] = std::min(box.upper[k], std::nextafter(float(most[side][k]), std::numeric_limits<float>::max()));
    }
    (side == 0 ? high : low)[a] = at;
    parts[std::size_t(side)] = {low, high};
  }
  return parts;
}

// Appends a leaf of these faces to the words; returns its number.
std::uint32_t add_leaf(const Mesh& mesh, float unit, std::span<const std::uint32_t> faces,
                       std::vector<std::uint32_t>& words) {
  words.resize((words.size() + MESH_LEAF_WORDS - 1) / MESH_LEAF_WORDS * MESH_LEAF_WORDS);
  const std::size_t at = words.size();
  // Corners at the same place are one vertex.
  std::vector<std::array<std::uint32_t, 3>> vertices;
  std::vector<std::uint32_t> corners(faces.size());
  for (std::size_t i = 0; i < faces.size(); i++) {
    for (int corner = 0; corner < 3; corner++) {
      const glm::vec3 place = unit * mesh.vertices()[mesh.faces()[faces[i]][corner]];
      const auto vertex = std::bit_cast<std::array<std::uint32_t, 3>>(place);
      const auto number = std::size_t(std::ranges::find(vertices, vertex) - vertices.begin());
      if (number == vertices.size()) vertices.push_back(vertex);
      corners[i] |= std::uint32_t(number) << (MESH_CORNER_BITS * corner);
    }
  }
  words.push_back(std::uint32_t(vertices.size() + MESH_LEAF_COUNT * faces.size()));
  words.insert(words.end(), corners.begin(), corners.end());
  for (const std::size_t axis : {0u, 1u, 2u}) {
    for (const auto& vertex : vertices) words.push_back(vertex[axis]);
  }
  words.insert(words.end(), faces.begin(), faces.end());
  return std::uint32_t(at / MESH_LEAF_WORDS);
}

float largest(const glm::vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

MeshHierarchy build_hierarchy(const Mesh& mesh, float unit, bool spatial_splits,
                              const std::function<void(std::size_t done, std::size_t total)>& progress) {
  // A leaf takes no more than MESH_LEAF_WORDS for each of its triangles.
  constexpr std::size_t most = (std::size_t(1) << 31) / MESH_LEAF_WORDS - 1;
  if (mesh.face_count() > most / (spatial_splits ? most_parts : 1))
    throw Error(ErrorCode::memory,
                fmt::format("the mesh has {} triangles; kernels can number {}", mesh.face_count(), most));

  std::vector<BvhBox> boxes(mesh.face_count());
  float greatest = 0;
  for (std::size_t i = 0; i < boxes.size(); i++) {
    const glm::uvec3 f = mesh.faces()[i];
    const glm::vec3 a = mesh.vertices()[f.x], b = mesh.vertices()[f.y], c = mesh.vertices()[f.z];
    boxes[i] = {unit * glm::min(glm::min(a, b), c), unit * glm::max(glm::max(a, b), c)};
    greatest = std::max({greatest, largest(boxes[i].lower), largest(boxes[i].upper)});
  }

  BvhOptions options;
  options.fewest_to_split = fewest_to_split;
  options.most_in_leaf = MESH_LEAF_MOST;
  options.box_cost = triangle_cost;
  // Boxes reach a little beyond their triangles, so that rounding misses none (kernels/bvh/packet.inc).
  options.margin = std::ldexp(greatest, -22);
  if (spatial_splits) {
    options.split = [&mesh, unit](std::uint32_t face, const BvhBox& box, int axis, float at) {
      return split(mesh, unit, face, box, axis, at);
    };
    options.most_parts = most_parts;
  }
  options.progress = progress;
  MeshHierarchy result;
  static_cast<Bvh&>(result) = build_bvh(std::move(boxes), options, [&](std::span<const std::uint32_t> faces) {
    return add_leaf(mesh, unit, faces, result.triangles);
  });
  // Lanes read whole vectors; those beyond the last triangle of a leaf take whatever stands there for a corner.
  result.triangles.resize(result.triangles.size() + (1 << MESH_CORNER_BITS));
  return result;
}

}  // namespace smurf
