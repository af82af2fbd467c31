// Marching cubes without a printed table: the polygons of the 256 cases are traced from the cube's faces once.
#include "peers/isosurface_mesh.hpp"

#include <array>
#include <utility>

namespace smurf::bench {
namespace {

// Corner c of a cell lies at ((c & 1), (c >> 1) & 1, c >> 2). Edge 4·axis + k runs along axis from edge_start(axis, k).
constexpr int edge_start(int axis, int k) {
  const int low = (1 << axis) - 1;
  return ((k & ~low) << 1) | (k & low);
}

constexpr int edge_between(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  const int start = a & b;
  const int low = (1 << axis) - 1;
  return 4 * axis + (((start >> 1) & ~low) | (start & low));
}

// The faces' corners, counter-clockwise seen from outside of the cell.
constexpr int face_corners[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

// Cell edges of the triangles of one case: at most 5 triangles, or a few more where a case splits otherwise.
using Case = std::vector<std::array<int, 3>>;

// Walks each face once around. Where the walk leaves the inside, the surface enters the face, and it leaves it
// where the walk had last come in; so inside corners are separated on ambiguous faces, alike from both sides.
Case trace_case(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& corners : face_corners) {
    for (int k = 0; k < 4; k++) {
      if (!(inside >> corners[k] & 1) || (inside >> corners[(k + 1) % 4] & 1)) continue;
      int back = k;
      while (inside >> corners[(back + 3) % 4] & 1) back = (back + 3) % 4;
      next[edge_between(corners[k], corners[(k + 1) % 4])] = edge_between(corners[(back + 3) % 4], corners[back]);
    }
  }
  Case triangles;
  for (int first = 0; first < 12; first++) {
    if (next[first] < 0) continue;
    std::vector<int> loop;
    for (int edge = first; edge >= 0;) {
      loop.push_back(edge);
      edge = std::exchange(next[edge], -1);
      if (edge == first) break;
    }
    for (std::size_t k = 2; k < loop.size(); k++) triangles.push_back({loop[0], loop[k - 1], loop[k]});
  }
  return triangles;
}

const std::array<Case, 256>& cases() {
  static const std::array<Case, 256> table = [] {
    std::array<Case, 256> all;
    for (int inside = 0; inside < 256; inside++) all[inside] = trace_case(inside);
    return all;
  }();
  return table;
}

}  // namespace

TriangleMesh isosurface_mesh(std::span<const float> samples, glm::ivec3 size, const GridPlacement& placement,
                             double isovalue) {
  TriangleMesh mesh;
  const std::size_t row = std::size_t(size.x), slice = row * std::size_t(size.y);
  // Vertex on the edge that starts at a node, per axis; nodes of two slices are remembered at a time.
  constexpr std::uint32_t none = ~0u;
  std::array<std::vector<std::uint32_t>, 6> known;
  for (auto& vertices : known) vertices.assign(slice, none);

  auto vertex = [&](glm::ivec3 cell, int edge) {
    const int axis = edge / 4, corner = edge_start(axis, edge % 4);
    const glm::ivec3 node = cell + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
    auto& slot = known[std::size_t(axis + 3 * (node.z & 1))][std::size_t(node.y) * row + std::size_t(node.x)];
    if (slot == none) {
      const std::size_t index = std::size_t(node.z) * slice + std::size_t(node.y) * row + std::size_t(node.x);
      const double a = samples[index], b = samples[index + (axis == 0 ? 1 : axis == 1 ? row : slice)];
      glm::dvec3 position(node);
      position[axis] += (isovalue - a) / (b - a);
      slot = std::uint32_t(mesh.vertices.size());
      mesh.vertices.push_back(glm::vec3(placement.origin + placement.axes * position));
    }
    return slot;
  };

  const bool mirrored = glm::determinant(placement.axes) < 0;
  for (glm::ivec3 cell(0); cell.z + 1 < size.z; cell.z++) {
    for (int axis = 0; axis < 3; axis++) std::ranges::fill(known[std::size_t(axis + 3 * ((cell.z + 1) & 1))], none);
    for (cell.y = 0; cell.y + 1 < size.y; cell.y++) {
      for (cell.x = 0; cell.x + 1 < size.x; cell.x++) {
        const float* s = samples.data() + std::size_t(cell.z) * slice + std::size_t(cell.y) * row + std::size_t(cell.x);
        const float corners[8] = {s[0],     s[1],         s[row],         s[row + 1],
                                  s[slice], s[slice + 1], s[slice + row], s[slice + row + 1]};
        int inside = 0;
        for (int corner = 0; corner < 8; corner++) inside |= int(corners[corner] >= isovalue) << corner;
        for (const auto& edges : cases()[std::size_t(inside)]) {
          glm::uvec3 t(vertex(cell, edges[0]), vertex(cell, edges[1]), vertex(cell, edges[2]));
          if (mirrored) std::swap(t.y, t.z);
          mesh.triangles.push_back(t);
        }
      }
    }
  }
  return mesh;
}

std::vector<float> samples_as_float(const Volume& volume) {
  std::vector<float> samples(volume.count());
  for (std::size_t i = 0; i < samples.size(); i++) samples[i] = float(volume.at(i));
  return samples;
}

TriangleMesh triangles_of(const Mesh& mesh) {
  return {{mesh.vertices().begin(), mesh.vertices().end()}, {mesh.faces().begin(), mesh.faces().end()}};
}

}  // namespace smurf::bench
