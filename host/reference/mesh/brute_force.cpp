#include "reference/mesh/brute_force.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <span>

#include "numerics/exact_sum.hpp"
#include "reference/mesh/vertices.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr std::size_t block_size = 32;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Line {
  dvec3 origin, direction;
};
using Corners = std::array<dvec3, 3>;

// ---- Exact signs and values

// Room for four determinants of doubles.
using Sum = ExactSum<96>;

void add_determinant(Sum& sum, const dvec3& a, const dvec3& b, const dvec3& c) {
  for (int x = 0; x < 3; x++) {
    const int y = (x + 1) % 3, z = (x + 2) % 3;
    sum.add_product(a[x], b[y], c[z]);
    sum.add_product(-a[x], b[z], c[y]);
  }
}

// det[d, a-o, b-o], written out so that no difference is rounded.
Sum edge_function(const Line& line, const dvec3& a, const dvec3& b) {
  Sum sum;
  add_determinant(sum, line.direction, a, b);
  add_determinant(sum, line.direction, b, line.origin);
  add_determinant(sum, line.direction, line.origin, a);
  return sum;
}

// The side that the moved line passes on, where the line itself meets the edge: the first component of d x (b-a) that
// is not zero.
int side_when_moved(const Line& line, const dvec3& a, const dvec3& b) {
  const dvec3& d = line.direction;
  for (int x = 0; x < 3; x++) {
    const int y = (x + 1) % 3, z = (x + 2) % 3;
    ExactSum<8> component;
    component.add_product(d[y], b[z]);
    component.add_product(-d[y], a[z]);
    component.add_product(-d[z], b[y]);
    component.add_product(d[z], a[y]);
    if (component.sign() != 0) return component.sign();
  }
  return 0;
}

// det[d, b-a, c-a]
Sum plane_slope(const Line& line, const Corners& p) {
  Sum sum;
  for (std::size_t k = 0; k < 3; k++) add_determinant(sum, line.direction, p[k], p[(k + 1) % 3]);
  return sum;
}

// det[a-o, b-a, c-a]
Sum plane_distance(const Line& line, const Corners& p) {
  Sum sum;
  add_determinant(sum, p[0], p[1], p[2]);
  for (std::size_t k = 0; k < 3; k++) add_determinant(sum, -line.origin, p[k], p[(k + 1) % 3]);
  return sum;
}

// ---- Quick rejections, in double with bounds on their error

// Whether two edge functions are sure to differ in sign. With p = a-o, q = b-a each rounded once, eight roundings at
// most stand between d·(p x q) and the truth, each at most 2^-53 of the sum of magnitudes.
bool surely_missed(const Line& line, const Corners& corners) {
  const dvec3& d = line.direction;
  bool positive = false, negative = false;
  for (std::size_t k = 0; k < 3; k++) {
    const dvec3 p = corners[k] - line.origin, q = corners[(k + 1) % 3] - corners[k];
    const dvec3 first(p.y * q.z, p.z * q.x, p.x * q.y), second(p.z * q.y, p.x * q.z, p.y * q.x);
    const double value = glm::dot(d, first - second);
    const double bound = 0x1p-49 * glm::dot(glm::abs(d), glm::abs(first) + glm::abs(second));
    positive |= value > bound;
    negative |= value < -bound;
  }
  return positive && negative;
}

// Whether the line passes by the box, seen along each axis in turn. The slack covers the roundings, which are relative
// to the magnitudes.
bool surely_passes(const Line& line, const dvec3& lower, const dvec3& upper) {
  const dvec3 d = line.direction, to_middle = 0.5 * (lower + upper) - line.origin, half = 0.5 * (upper - lower);
  const dvec3 size = glm::abs(line.origin) + glm::abs(lower) + glm::abs(upper);
  for (int x = 0; x < 3; x++) {
    const int y = (x + 1) % 3, z = (x + 2) % 3;
    const double reach = half[y] * std::abs(d[z]) + half[z] * std::abs(d[y]);
    const double slack = 0x1p-48 * (size[y] * std::abs(d[z]) + size[z] * std::abs(d[y]));
    if (std::abs(d[y] * to_middle[z] - d[z] * to_middle[y]) > reach + slack) return true;
  }
  return false;
}

double distance_to_box(const dvec3& point, const dvec3& lower, const dvec3& upper) {
  return glm::length(glm::max(glm::max(lower - point, point - upper), dvec3(0.0)));
}

// ---- One triangle

struct Crossing {
  double t, u, v;
};

std::optional<Crossing> crossing(const Line& line, const Corners& p) {
  if (surely_missed(line, p)) return std::nullopt;
  const Sum slope = plane_slope(line, p);
  if (slope.sign() == 0) return std::nullopt;
  std::array<double, 3> weights;  // of the corner opposite to each edge
  for (std::size_t k = 0; k < 3; k++) {
    const dvec3 &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
    const Sum edge = edge_function(line, a, b);
    const int side = edge.sign() != 0 ? edge.sign() : side_when_moved(line, a, b);
    if (side != slope.sign()) return std::nullopt;  // the three sum up to the slope
    weights[k] = edge.value() / slope.value();
  }
  const double u = std::clamp(weights[1], 0.0, 1.0);
  return Crossing{plane_distance(line, p).value() / slope.value(), u, std::clamp(weights[2], 0.0, 1 - u)};
}

// The point of the triangle that is nearest (Ericson 2005, section 5.1.5), as u and v.
std::array<double, 2> nearest_in_triangle(const Corners& p, const dvec3& point) {
  const dvec3 ab = p[1] - p[0], ac = p[2] - p[0], to_a = point - p[0], to_b = point - p[1], to_c = point - p[2];
  const double d1 = glm::dot(ab, to_a), d2 = glm::dot(ac, to_a);
  if (d1 <= 0 && d2 <= 0) return {0, 0};
  const double d3 = glm::dot(ab, to_b), d4 = glm::dot(ac, to_b);
  if (d3 >= 0 && d4 <= d3) return {1, 0};
  const double at_c = d1 * d4 - d3 * d2;
  if (at_c <= 0 && d1 >= 0 && d3 <= 0) return {d1 / (d1 - d3), 0};
  const double d5 = glm::dot(ab, to_c), d6 = glm::dot(ac, to_c);
  if (d6 >= 0 && d5 <= d6) return {0, 1};
  const double at_b = d5 * d2 - d1 * d6;
  if (at_b <= 0 && d2 >= 0 && d6 <= 0) return {0, d2 / (d2 - d6)};
  const double at_a = d3 * d6 - d5 * d4, along = d4 - d3, back = d5 - d6;
  if (at_a <= 0 && along >= 0 && back >= 0) {
    const double v = along / (along + back);
    return {1 - v, v};
  }
  const double sum = at_a + at_b + at_c, u = std::clamp(at_b / sum, 0.0, 1.0);
  return {u, std::clamp(at_c / sum, 0.0, 1 - u)};
}

Corners corners_of(const Mesh& mesh, std::size_t face) {
  const glm::uvec3& f = mesh.faces()[face];
  return {dvec3(mesh.vertices()[f.x]), dvec3(mesh.vertices()[f.y]), dvec3(mesh.vertices()[f.z])};
}

// The triangles by the places of their middles along Morton's curve.
std::vector<std::uint32_t> places_along_curve(const Mesh& mesh) {
  const dvec3 lower(mesh.lower()),
      size = glm::max(dvec3(mesh.upper()) - lower, dvec3(std::numeric_limits<double>::min()));
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  for (std::uint32_t face = 0; face < mesh.face_count(); face++) {
    const Corners p = corners_of(mesh, face);
    const glm::uvec3 cell(glm::clamp((p[0] / 3.0 + p[1] / 3.0 + p[2] / 3.0 - lower) / size, 0.0, 1.0) * 0x1fffffp0);
    std::uint64_t key = 0;
    for (int bit = 20; bit >= 0; bit--) {
      for (int axis = 0; axis < 3; axis++) key = key << 1 | (cell[axis] >> bit & 1);
    }
    keys.emplace_back(key, face);
  }
  std::ranges::sort(keys);
  std::vector<std::uint32_t> order;
  for (const auto& [key, face] : keys) order.push_back(face);
  return order;
}

// What the rounding of coordinates to floats alone can make of a difference of curvatures.
double rounding_of_curvature(const Corners& p) {
  double longest = 0, size = 0;
  for (std::size_t k = 0; k < 3; k++) {
    const dvec3 edge = glm::abs(p[(k + 1) % 3] - p[k]), place = glm::abs(p[k]);
    longest = std::max({longest, edge.x, edge.y, edge.z});
    size = std::max({size, place.x, place.y, place.z});
  }
  return 0x1p-21 * (size + longest) / (longest * longest);
}

dvec3 weights_of(const MeshPoint& point) { return {std::max(0.0, 1 - point.u - point.v), point.u, point.v}; }

}  // namespace

struct ReferenceMesh::Properties {
  std::once_flag normals_found, curvatures_found;
  std::vector<dvec3> normals;
  std::vector<glm::dmat3> tensors;
};

ReferenceMesh::ReferenceMesh(const Mesh& mesh)
    : mesh_(mesh), order_(places_along_curve(mesh)), properties_(std::make_unique<Properties>()) {
  for (std::size_t first = 0; first < order_.size(); first += block_size) {
    Box box{dvec3(std::numeric_limits<double>::infinity()), dvec3(-std::numeric_limits<double>::infinity())};
    for (const std::uint32_t face : block(blocks_.size())) {
      for (const dvec3& p : corners_of(mesh, face)) box = {glm::min(box.lower, p), glm::max(box.upper, p)};
    }
    blocks_.push_back(box);
  }
}

std::span<const std::uint32_t> ReferenceMesh::block(std::size_t number) const {
  const std::size_t first = number * block_size;
  return std::span(order_).subspan(first, std::min(block_size, order_.size() - first));
}

ReferenceMesh::~ReferenceMesh() = default;

std::vector<MeshHit> ReferenceMesh::hits(const ReferenceRay& ray, bool first_only) const {
  const Line line{ray.origin, ray.direction};
  std::vector<MeshHit> hits;
  for (std::size_t i = 0; i < blocks_.size(); i++) {
    if (surely_passes(line, blocks_[i].lower, blocks_[i].upper)) continue;
    for (const std::uint32_t face : block(i)) {
      const auto found = crossing(line, corners_of(mesh_, face));
      if (found && found->t >= ray.t_min && found->t <= ray.t_max)
        hits.push_back({found->t, {face, found->u, found->v}});
    }
  }
  std::ranges::sort(hits,
                    [](const MeshHit& a, const MeshHit& b) { return a.t != b.t ? a.t < b.t : a.at.face < b.at.face; });
  if (first_only && hits.size() > 1) hits.resize(1);
  return hits;
}

dvec3 ReferenceMesh::location(const MeshPoint& point) const {
  const Corners p = corners_of(mesh_, point.face);
  const dvec3 w = weights_of(point);
  return w.x * p[0] + w.y * p[1] + w.z * p[2];
}

dvec3 ReferenceMesh::face_normal(std::uint32_t face) const { return triangle_normal(mesh_, face); }

dvec3 ReferenceMesh::interpolated_normal(const MeshPoint& point) const {
  std::call_once(properties_->normals_found, [this] { properties_->normals = vertex_normals(mesh_); });
  const glm::uvec3& f = mesh_.faces()[point.face];
  const dvec3 w = weights_of(point);
  dvec3 sum(0.0);
  for (int k = 0; k < 3; k++) sum += w[k] * properties_->normals[f[k]];
  const double length = glm::length(sum);
  return length > 0 ? sum / length : dvec3(nan);
}

SurfaceFrame ReferenceMesh::measure(const MeshPoint& point, bool of_face) const {
  const dvec3 normal = of_face ? face_normal(point.face) : interpolated_normal(point);
  std::call_once(properties_->curvatures_found, [this] { properties_->tensors = jet_tensors(mesh_); });
  const glm::uvec3& f = mesh_.faces()[point.face];
  const dvec3 w = weights_of(point);
  glm::dmat3 tensor(0.0);
  std::uint32_t status = PointStatus::regular;
  for (int k = 0; k < 3; k++) {
    if (w[k] == 0) continue;
    tensor += w[k] * properties_->tensors[f[k]];
    if ((mesh_.vertex_states()[f[k]] & vertex_boundary) != 0) status |= PointStatus::boundary;
  }
  SurfaceFrame frame = level_set_frame(normal, tensor, 1, rounding_of_curvature(corners_of(mesh_, point.face)));
  frame.normal = normal;
  frame.status |= status;
  return frame;
}

NearestMeshPoint ReferenceMesh::nearest(const dvec3& point) const {
  NearestMeshPoint best{{}, std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < blocks_.size(); i++) {
    // A hair's breadth that rounding may have moved the box away by.
    if (distance_to_box(point, blocks_[i].lower, blocks_[i].upper) * (1 - 0x1p-48) > best.distance) continue;
    for (const std::uint32_t face : block(i)) {
      const Corners p = corners_of(mesh_, face);
      const auto [u, v] = nearest_in_triangle(p, point);
      const MeshPoint at{face, u, v};
      const double distance = glm::distance(location(at), point);
      if (distance < best.distance || (distance == best.distance && face < best.at.face)) best = {at, distance};
    }
  }
  return best;
}

std::size_t ReferenceMesh::bytes() const {
  return mesh_.bytes() + order_.size() * sizeof(std::uint32_t) + blocks_.size() * sizeof(Box) +
         properties_->normals.size() * sizeof(dvec3) + properties_->tensors.size() * sizeof(glm::dmat3);
}

}  // namespace smurf
