#include "reference/walk/mesh.hpp"

#include <algorithm>
#include <cmath>

namespace smurf {
namespace {

using glm::dvec3;

// Weights below this are those of points on an edge, or in a corner; coordinates may have been floats.
constexpr double on_edge = 4e-7;
// Segments shorter than this part of the chord have no direction.
constexpr double no_length = 1e-9;

}  // namespace

MeshSections::MeshSections(const Mesh& mesh) : mesh_(mesh), first_of_(mesh.vertex_count() + 1, 0) {
  const auto faces = mesh_.faces();
  edges_.reserve(3 * faces.size());
  for (std::uint32_t face = 0; face < faces.size(); face++) {
    for (int i = 0; i < 3; i++) {
      const std::uint32_t a = faces[face][i], b = faces[face][(i + 1) % 3];
      edges_.push_back({std::min(a, b), std::max(a, b), face});
      first_of_[a + 1]++;
    }
  }
  std::sort(edges_.begin(), edges_.end());
  for (std::size_t i = 1; i < first_of_.size(); i++) first_of_[i] += first_of_[i - 1];
  faces_of_.resize(3 * faces.size());
  std::vector<std::uint32_t> next(first_of_.begin(), first_of_.end() - 1);
  for (std::uint32_t face = 0; face < faces.size(); face++) {
    for (int i = 0; i < 3; i++) faces_of_[next[faces[face][i]]++] = face;
  }
}

std::size_t MeshSections::bytes() const {
  return edges_.size() * sizeof(Edge) + (first_of_.size() + faces_of_.size()) * sizeof(std::uint32_t);
}

// Never 0.
double MeshSections::side(const Plane& plane, std::uint32_t vertex_number) const {
  const double distance = glm::dot(plane.normal, vertex(vertex_number) - plane.origin);
  return distance == 0 ? std::numeric_limits<double>::min() : distance;
}

// The same whichever way the edge is given.
dvec3 MeshSections::crossing(const Plane& plane, std::uint32_t a, std::uint32_t b) const {
  if (a > b) std::swap(a, b);
  const double da = side(plane, a), db = side(plane, b);
  return vertex(a) + da / (da - db) * (vertex(b) - vertex(a));
}

// Two, or none.
std::vector<MeshSections::Exit> MeshSections::exits(const Plane& plane, std::uint32_t face) const {
  std::vector<Exit> found;
  const glm::uvec3 corners = mesh_.faces()[face];
  for (int i = 0; i < 3; i++) {
    const std::uint32_t a = corners[i], b = corners[(i + 1) % 3];
    if ((side(plane, a) > 0) != (side(plane, b) > 0)) found.push_back({a, b, crossing(plane, a, b)});
  }
  return found;
}

// All that have the point, the one that it is given in first.
std::vector<std::uint32_t> MeshSections::faces_at(const MeshPoint& at) const {
  std::vector<std::uint32_t> found{at.face};
  const glm::uvec3 corners = mesh_.faces()[at.face];
  const dvec3 weights(1 - at.u - at.v, at.u, at.v);
  std::vector<std::uint32_t> of_weight;
  for (int i = 0; i < 3; i++) {
    if (weights[i] > on_edge) of_weight.push_back(corners[i]);
  }
  if (of_weight.size() == 3 || of_weight.empty()) return found;
  for (std::uint32_t i = first_of_[of_weight[0]]; i < first_of_[of_weight[0] + 1]; i++) {
    const std::uint32_t face = faces_of_[i];
    const glm::uvec3 c = mesh_.faces()[face];
    const std::uint32_t other = of_weight.back();
    if (face != at.face && (c.x == other || c.y == other || c.z == other)) found.push_back(face);
  }
  return found;
}

MeshSections::Exit MeshSections::exit_of(const Plane& plane, std::uint32_t face, const Exit& entry) const {
  for (const Exit& exit : exits(plane, face)) {
    const bool same =
        (exit.from == entry.from && exit.to == entry.to) || (exit.from == entry.to && exit.to == entry.from);
    if (!same) return exit;
  }
  return entry;  // a triangle that names a vertex twice; there are none
}

std::optional<std::uint32_t> MeshSections::next_face(const Plane& plane, std::uint32_t face, const Exit& exit,
                                                     const dvec3& heading) const {
  const std::uint32_t low = std::min(exit.from, exit.to), high = std::max(exit.from, exit.to);
  std::optional<std::uint32_t> best;
  double straightest = -2;
  for (auto it = std::lower_bound(edges_.begin(), edges_.end(), Edge{low, high, 0});
       it != edges_.end() && it->low == low && it->high == high; ++it) {
    if (it->face == face) continue;
    const dvec3 way = exit_of(plane, it->face, exit).location - exit.location;
    const double size = glm::length(way);
    const double straight = size > 0 ? glm::dot(way, heading) / size : 0;
    if (best && straight <= straightest) continue;
    best = it->face;
    straightest = straight;
  }
  return best;
}

SectionEnd MeshSections::place(std::uint32_t face, const dvec3& location, WalkStatus outcome) const {
  const glm::uvec3 corners = mesh_.faces()[face];
  const dvec3 a = vertex(corners.x), b = vertex(corners.y) - a, c = vertex(corners.z) - a, q = location - a;
  const dvec3 n = glm::cross(b, c);
  const double area = glm::dot(n, n);
  double u = std::clamp(glm::dot(glm::cross(q, c), n) / area, 0.0, 1.0);
  double v = std::clamp(glm::dot(glm::cross(b, q), n) / area, 0.0, 1.0);
  if (u + v > 1) u /= u + v, v = 1 - u;
  return {location, outcome, face, u, v};
}

SectionEnd MeshSections::follow(const SectionStart& start, const MeshPoint& at) const {
  const Plane plane{start.location, start.across()};
  const double r = start.chord;
  // The triangle to begin in, and where the curve leaves it.
  std::optional<std::uint32_t> first;
  Exit exit{};
  // In its own triangle the curve goes on in the direction. Across an edge it may turn back; about a corner, which may be
  // one of the border, only a little.
  double aligned = -2;
  const bool on_side = (1 - at.u - at.v <= on_edge) + (at.u <= on_edge) + (at.v <= on_edge) == 1;
  for (const std::uint32_t face : faces_at(at)) {
    const double least = face == at.face ? 0 : on_side ? -1.1 : -0.2;
    for (const Exit& candidate : exits(plane, face)) {
      const dvec3 way = candidate.location - start.location;
      const double size = glm::length(way);
      if (!(size > no_length * r)) continue;
      const double cosine = glm::dot(way, start.direction) / size;
      if (cosine <= least || cosine <= aligned + (first ? 1e-9 : 0.0)) continue;
      aligned = cosine;
      first = face;
      exit = candidate;
    }
  }
  if (!first) return place(at.face, start.location, WalkStatus::boundary);

  std::uint32_t face = *first;
  dvec3 from = start.location, heading = start.direction;
  bool creased = false, turned = false;
  for (std::size_t i = 0; i <= mesh_.face_count() + 1; i++) {
    const dvec3 way = exit.location - from;
    const double size = glm::length(way);
    if (size > no_length * r) {
      // Before the first there is nothing to turn from.
      if (turned && glm::dot(way, heading) < section_crease_cosine * size) creased = true;
      heading = way / size;
      turned = true;
    }
    if (glm::length(exit.location - start.location) >= r) {
      // |from + s·way - start| = r, without cancellation.
      const dvec3 off = from - start.location;
      const double a = glm::dot(way, way), b = glm::dot(off, way), c = glm::dot(off, off) - r * r;
      const double root = std::sqrt(std::max(b * b - a * c, 0.0));
      const double s = std::clamp(b > 0 ? -c / (b + root) : (root - b) / a, 0.0, 1.0);
      return place(face, from + s * way, creased ? WalkStatus::crease : WalkStatus::reached);
    }
    const auto next = next_face(plane, face, exit, heading);
    if (!next) return place(face, exit.location, WalkStatus::boundary);
    face = *next;
    if (face == *first) return place(at.face, start.location, WalkStatus::unreachable);
    from = exit.location;
    exit = exit_of(plane, face, exit);
  }
  return place(at.face, start.location, WalkStatus::unresolved);
}

}  // namespace smurf
