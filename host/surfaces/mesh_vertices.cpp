#include "surfaces/mesh_vertices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <span>

#include "mesh_parameters.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::uint32_t;

constexpr std::size_t fewest_points = 12;   // a fit goes on beyond two rings until it has so many,
constexpr std::size_t most_points = 64;     // and takes no more than these beyond the first ring
constexpr std::size_t most_passed_on = 32;  // a vertex with more neighbours is the hub of a fan: it leads no further

void require_room(std::size_t words, const Mesh& mesh) {
  constexpr std::size_t most = (std::size_t(1) << 31) - 1;
  if (words > most)
    throw Error(
        ErrorCode::memory,
        fmt::format("normals of a mesh of {} vertices and {} triangles take tables of {} words; kernels can number {}",
                    mesh.vertex_count(), mesh.face_count(), words, most));
}

std::vector<uint32_t> places_and_states(const Mesh& mesh, float unit) {
  std::vector<uint32_t> words(MESH_VERTEX_WORDS * mesh.vertex_count());
  std::size_t at = 0;
  const auto states = mesh.vertex_states();
  const auto places = mesh.vertices();
  for (std::size_t v = 0; v < mesh.vertex_count(); v++, at += MESH_VERTEX_WORDS) {
    for (int axis = 0; axis < 3; axis++)
      words[at + std::size_t(axis)] = std::bit_cast<uint32_t>(unit * places[v][axis]);
    const bool no_curvature = (states[v] & (vertex_non_manifold | vertex_unreferenced)) != 0;
    const int state = ((states[v] & vertex_boundary) != 0 ? MESH_BOUNDARY : 0) + (no_curvature ? MESH_NO_CURVATURE : 0);
    words[at + 3] = std::bit_cast<uint32_t>(float(state));
  }
  return words;
}

// Counted, then filled in the order of faces.
std::vector<uint32_t> pairs_by_vertex(const Mesh& mesh) {
  const std::size_t count = mesh.vertex_count();
  std::vector<uint32_t> words(count + 1 + 6 * mesh.face_count()), next(count + 1);
  for (const glm::uvec3& face : mesh.faces())
    for (int k = 0; k < 3; k++) words[face[k] + 1] += 2;
  words[0] = uint32_t(count + 1);
  for (std::size_t v = 0; v < count; v++) next[v] = words[v], words[v + 1] += words[v];
  for (const glm::uvec3& face : mesh.faces()) {
    for (int k = 0; k < 3; k++) {
      words[next[face[k]]++] = face[(k + 1) % 3];
      words[next[face[k]]++] = face[(k + 2) % 3];
    }
  }
  return words;
}

// Neighbours ring by ring; `pairs` is what pairs_by_vertex gives.
class Rings {
 public:
  Rings(const Mesh& mesh, const std::vector<uint32_t>& pairs)
      : pairs_(pairs),
        states_(mesh.vertex_states()),
        is_consistent_(mesh.topology().inconsistent_edges == 0),
        seen_(mesh.vertex_count(), ~0u) {}

  // Appends the neighbours of a vertex.
  void add(uint32_t vertex, std::vector<uint32_t>& words) {
    const std::size_t begin = words.size();
    seen_[vertex] = vertex;
    add_around(vertex, vertex, words, ~std::size_t(0));
    std::size_t from = begin, to = words.size();
    for (int ring = 1; from < to && (ring < 2 || to - begin + 1 < fewest_points); ring++) {
      for (std::size_t i = from; i < to; i++) {
        const uint32_t other = words[i];
        const bool is_hub = (pairs_[other + 1] - pairs_[other]) / 2 > most_passed_on;
        if (!is_hub) add_around(vertex, other, words, begin + most_points);
      }
      from = to;
      to = words.size();
    }
    // What a hub leads to is taken where there is nothing else.
    for (std::size_t i = begin; i < words.size() && words.size() - begin + 1 < fewest_points; i++)
      add_around(vertex, words[i], words, begin + fewest_points);
  }

 private:
  void add_around(uint32_t vertex, uint32_t other, std::vector<uint32_t>& words, std::size_t most) {
    // About an inner vertex each neighbour is the first of one pair.
    const uint32_t step = is_consistent_ && states_[other] == vertex_regular ? 2 : 1;
    for (uint32_t i = pairs_[other]; i < pairs_[other + 1] && words.size() < most; i += step) {
      if (seen_[pairs_[i]] == vertex) continue;
      seen_[pairs_[i]] = vertex;
      words.push_back(pairs_[i]);
    }
  }

  const std::vector<uint32_t>& pairs_;
  const std::span<const std::uint8_t> states_;
  const bool is_consistent_;
  std::vector<uint32_t> seen_;  // per vertex, for which one it was last added
};

}  // namespace

MeshVertices vertices_of(const Mesh& mesh, float unit) {
  const std::size_t count = mesh.vertex_count();
  require_room(std::max(6 * mesh.face_count() + count, MESH_VERTEX_WORDS * count), mesh);
  MeshVertices result;
  result.vertices = places_and_states(mesh, unit);
  result.pairs = pairs_by_vertex(mesh);
  Rings rings(mesh, result.pairs);
  result.rings.reserve(22 * count);
  result.rings.resize(count + 1);
  for (std::size_t v = 0; v < count; v++) {
    result.rings[v] = uint32_t(result.rings.size());
    rings.add(uint32_t(v), result.rings);
    require_room(result.rings.size(), mesh);
  }
  result.rings[count] = uint32_t(result.rings.size());
  return result;
}

}  // namespace smurf
