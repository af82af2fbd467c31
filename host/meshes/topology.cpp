// How the triangles of a mesh hang together: edges by bucket sort of corners by their edge's lower vertex, fans of
// triangles about vertices by union-find over corners.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "meshes/data.hpp"

namespace smurf {
namespace {

using std::uint32_t;
using Faces = std::span<const glm::uvec3>;

// Union-find with path halving; the least member names the set.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(uint32_t a, uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parent_;
};

// A triangle's side, from its corner to the next; corner = 3 · face + 0, 1 or 2.
struct Side {
  uint32_t higher;  // vertex
  uint32_t corner;
};

uint32_t corner_vertex(Faces faces, uint32_t corner) { return faces[corner / 3][int(corner % 3)]; }
uint32_t next_corner(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

// The sides that begin or end at each vertex and go to a higher one: those of vertex v are sides[first[v]] ..
// sides[first[v + 1] - 1].
struct SidesByLowerVertex {
  std::vector<std::uint64_t> first;
  std::vector<Side> sides;

  SidesByLowerVertex(std::size_t vertices, Faces faces) : first(vertices + 2), sides(3 * faces.size()) {
    const auto corners = uint32_t(3 * faces.size());
    const auto lower = [&](uint32_t c) {
      return std::min(corner_vertex(faces, c), corner_vertex(faces, next_corner(c)));
    };
    const auto higher = [&](uint32_t c) {
      return std::max(corner_vertex(faces, c), corner_vertex(faces, next_corner(c)));
    };
    for (uint32_t c = 0; c < corners; c++) first[lower(c) + 2]++;
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (uint32_t c = 0; c < corners; c++) sides[first[lower(c) + 1]++] = {higher(c), c};
    first.pop_back();
    for (std::size_t v = 0; v + 1 < first.size(); v++)
      std::sort(sides.begin() + std::ptrdiff_t(first[v]), sides.begin() + std::ptrdiff_t(first[v + 1]),
                [](const Side& a, const Side& b) {
                  return a.higher != b.higher ? a.higher < b.higher : a.corner < b.corner;
                });
  }
};

class TopologyFinder {
 public:
  TopologyFinder(std::span<const glm::vec3> vertices, Faces faces, MeshTopology& topology,
                 std::vector<std::uint8_t>& states)
      : vertices_(vertices), faces_(faces), topology_(topology), states_(states), fans_(3 * faces.size()) {}

  void find() {
    states_.assign(vertices_.size(), vertex_unreferenced);
    for (const glm::uvec3& face : faces_) states_[face.x] = states_[face.y] = states_[face.z] = vertex_regular;
    visit_edges();
    visit_fans();
    count_components();
    topology_.faces = faces_.size();
    topology_.vertices = std::uint64_t(std::ranges::count_if(states_, [](auto s) { return s != vertex_unreferenced; }));
    topology_.non_manifold_vertices =
        std::uint64_t(std::ranges::count_if(states_, [](auto s) { return (s & vertex_non_manifold) != 0; }));
    topology_.euler_characteristic =
        std::int64_t(topology_.vertices) - std::int64_t(topology_.edges) + std::int64_t(topology_.faces);
    topology_.closed = !has_odd_edges_;
    topology_.manifold = topology_.non_manifold_vertices == 0;  // as the ends of non-manifold edges are
    measure();
  }

 private:
  void visit_edges() {
    const SidesByLowerVertex by_vertex(vertices_.size(), faces_);
    for (uint32_t lower = 0; lower < vertices_.size(); lower++) {
      const std::uint64_t end = by_vertex.first[lower + 1];
      for (std::uint64_t i = by_vertex.first[lower], next = i; i < end; i = next) {
        while (next < end && by_vertex.sides[next].higher == by_vertex.sides[i].higher) next++;
        visit_edge(lower, std::span(by_vertex.sides).subspan(i, next - i));
      }
    }
  }

  // All triangles of one edge.
  void visit_edge(uint32_t lower, std::span<const Side> sides) {
    const uint32_t higher = sides[0].higher;
    topology_.edges++;
    topology_.boundary_edges += sides.size() == 1;
    topology_.non_manifold_edges += sides.size() > 2;
    has_odd_edges_ |= sides.size() % 2 == 1;
    const std::uint8_t state = sides.size() == 1  ? vertex_boundary
                               : sides.size() > 2 ? vertex_non_manifold
                                                  : vertex_regular;
    states_[lower] |= state;
    states_[higher] |= state;
    std::int64_t upward = 0;  // sides from the lower vertex to the higher, less the others
    for (const Side& side : sides) {
      const bool up = corner_vertex(faces_, side.corner) == lower;
      upward += up ? 1 : -1;
      const uint32_t low = up ? side.corner : next_corner(side.corner),
                     high = up ? next_corner(side.corner) : side.corner;
      const bool first_up = corner_vertex(faces_, sides[0].corner) == lower;
      fans_.join(low, first_up ? sides[0].corner : next_corner(sides[0].corner));
      fans_.join(high, first_up ? next_corner(sides[0].corner) : sides[0].corner);
    }
    topology_.inconsistent_edges += std::abs(upward) > std::int64_t(sides.size() % 2);
  }

  // A vertex whose corners are not all of one fan is where parts of the surface touch.
  void visit_fans() {
    constexpr uint32_t none = 0xffffffffu;
    std::vector<uint32_t> fan_of(vertices_.size(), none);
    for (uint32_t corner = 0; corner < 3 * faces_.size(); corner++) {
      const uint32_t vertex = corner_vertex(faces_, corner), fan = fans_.find(corner);
      if (fan_of[vertex] == none) fan_of[vertex] = fan;
      if (fan_of[vertex] != fan) states_[vertex] |= vertex_non_manifold;
    }
  }

  void count_components() {
    Sets sets(vertices_.size());
    for (const glm::uvec3& face : faces_) {
      sets.join(face.x, face.y);
      sets.join(face.x, face.z);
    }
    for (uint32_t v = 0; v < vertices_.size(); v++)
      topology_.components += states_[v] != vertex_unreferenced && sets.find(v) == v;
  }

  // The volume about the middle of the box, where cancellation is least.
  void measure() {
    glm::dvec3 lower(vertices_[faces_[0].x]), upper = lower;
    for (const glm::uvec3& face : faces_) {
      for (int k = 0; k < 3; k++) {
        lower = glm::min(lower, glm::dvec3(vertices_[face[k]]));
        upper = glm::max(upper, glm::dvec3(vertices_[face[k]]));
      }
    }
    const glm::dvec3 middle = 0.5 * (lower + upper);
    double volume = 0, size = 0;
    for (const glm::uvec3& face : faces_) {
      const glm::dvec3 a = glm::dvec3(vertices_[face.x]) - middle, b = glm::dvec3(vertices_[face.y]) - middle,
                       c = glm::dvec3(vertices_[face.z]) - middle;
      topology_.area += 0.5 * glm::length(glm::cross(b - a, c - a));
      const double part = glm::dot(a, glm::cross(b, c)) / 6;
      volume += part;
      size += std::abs(part);
    }
    const bool consistent = topology_.inconsistent_edges == 0;
    if (topology_.closed && consistent) topology_.volume = volume;
    topology_.orientation = !consistent                          ? MeshOrientation::mixed
                            : !topology_.closed                  ? MeshOrientation::open
                            : std::abs(volume) <= 0x1p-40 * size ? MeshOrientation::flat
                            : volume > 0                         ? MeshOrientation::outward
                                                                 : MeshOrientation::inward;
  }

  std::span<const glm::vec3> vertices_;
  Faces faces_;
  MeshTopology& topology_;
  std::vector<std::uint8_t>& states_;
  Sets fans_;
  bool has_odd_edges_ = false;
};

}  // namespace

void find_topology(std::span<const glm::vec3> vertices, Faces faces, MeshTopology& topology,
                   std::vector<std::uint8_t>& vertex_states) {
  TopologyFinder(vertices, faces, topology, vertex_states).find();
}

}  // namespace smurf
