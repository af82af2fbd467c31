#include "reference/mesh/vertices.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "numerics/exact_sum.hpp"
#include "numerics/parallel.hpp"

namespace smurf {
namespace {

using glm::dvec3;
using std::uint32_t;

constexpr int greatest_degree = 4;
const glm::dmat3 unknown(dvec3(std::numeric_limits<double>::quiet_NaN()),
                         dvec3(std::numeric_limits<double>::quiet_NaN()),
                         dvec3(std::numeric_limits<double>::quiet_NaN()));

std::size_t coefficients(int degree) { return std::size_t((degree + 1) * (degree + 2) / 2); }

// A regular mesh's two rings have 19 points: more would smooth, fewer leave no choice.
std::size_t wanted_points(int degree) { return coefficients(degree) * 6 / 5; }

// Per vertex those that an edge leads to: at[first[v]] .. at[first[v + 1] - 1], in ascending order.
struct Neighbours {
  std::vector<std::size_t> first;
  std::vector<uint32_t> at;

  explicit Neighbours(const Mesh& mesh) {
    std::vector<std::pair<uint32_t, uint32_t>> pairs;
    pairs.reserve(6 * mesh.face_count());
    for (const glm::uvec3& face : mesh.faces()) {
      for (int k = 0; k < 3; k++) {
        pairs.emplace_back(face[k], face[(k + 1) % 3]);
        pairs.emplace_back(face[(k + 1) % 3], face[k]);
      }
    }
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    first.resize(mesh.vertex_count() + 1);
    for (const auto& [from, to] : pairs) {
      first[from + 1]++;
      at.push_back(to);
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
  }

  // The vertex and whole rings about it, two at least, until there are at least `wanted`.
  std::vector<uint32_t> rings(uint32_t vertex, std::size_t wanted) const {
    std::vector<uint32_t> found = {vertex}, sorted = found;
    int ring_count = 0;
    for (std::size_t begin = 0, end = 1; begin < end && (found.size() < wanted || ring_count < 2);
         begin = end, end = found.size()) {
      ring_count++;
      for (std::size_t i = begin; i < end; i++)
        found.insert(found.end(), at.begin() + std::ptrdiff_t(first[found[i]]),
                     at.begin() + std::ptrdiff_t(first[found[i] + 1]));
      std::vector<uint32_t> ring(found.begin() + std::ptrdiff_t(end), found.end()), fresh;
      std::ranges::sort(ring);
      ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
      std::ranges::set_difference(ring, sorted, std::back_inserter(fresh));
      found.resize(end);
      found.insert(found.end(), fresh.begin(), fresh.end());
      sorted.insert(sorted.end(), fresh.begin(), fresh.end());
      std::inplace_merge(sorted.begin(), sorted.end() - std::ptrdiff_t(fresh.size()), sorted.end());
    }
    return found;
  }
};

struct TangentFrame {
  dvec3 x, y, z;
};

TangentFrame frame_about(const dvec3& normal) {
  const int least = std::abs(normal.x) <= std::abs(normal.y) && std::abs(normal.x) <= std::abs(normal.z) ? 0
                    : std::abs(normal.y) <= std::abs(normal.z)                                           ? 1
                                                                                                         : 2;
  dvec3 axis(0.0);
  axis[least] = 1;
  const dvec3 x = glm::normalize(glm::cross(normal, axis));
  return {x, glm::cross(normal, x), normal};
}

// The first and second derivatives at 0 of the polynomial z(x, y) that fits best.
struct JetFit {
  double x, y, xx, xy, yy;
};

std::optional<JetFit> fit(const std::vector<dvec3>& points, int degree) {
  Eigen::MatrixXd powers(points.size(), coefficients(degree));
  Eigen::VectorXd heights(points.size());
  for (std::size_t i = 0; i < points.size(); i++) {
    const auto row = Eigen::Index(i);
    Eigen::Index column = 0;  // 1, x, y, x², xy, y², …
    for (int total = 0; total <= degree; total++) {
      for (int j = 0; j <= total; j++)
        powers(row, column++) = std::pow(points[i].x, total - j) * std::pow(points[i].y, j);
    }
    heights(row) = points[i].z;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(powers);
  solver.setThreshold(1e-6);  // what coordinates in float, and points on a conic, can still tell apart
  if (solver.rank() < powers.cols()) return std::nullopt;
  const Eigen::VectorXd c = solver.solve(heights);
  return JetFit{c(1), c(2), 2 * c(3), c(4), 2 * c(5)};
}

// With the unit normal n = ∇F/|∇F| of F = z - f(x, y): P·∇∇F·P/|∇F|, P = I - n nᵀ; in the world's axes.
glm::dmat3 tensor_of(const JetFit& jet, double scale, const TangentFrame& frame) {
  const dvec3 gradient(-jet.x, -jet.y, 1.0);
  const double length = glm::length(gradient);
  const dvec3 n = gradient / length;
  const glm::dmat3 hessian(-jet.xx, -jet.xy, 0, -jet.xy, -jet.yy, 0, 0, 0, 0);
  const glm::dmat3 projection = glm::dmat3(1.0) - glm::outerProduct(n, n);
  const glm::dmat3 axes(frame.x, frame.y, frame.z);
  return axes * (projection * hessian * projection) * glm::transpose(axes) / (length * scale);
}

glm::dmat3 jet_tensor(const Mesh& mesh, const Neighbours& neighbours, uint32_t vertex, const dvec3& normal) {
  const std::vector<uint32_t> around = neighbours.rings(vertex, wanted_points(greatest_degree));
  const dvec3 centre(mesh.vertices()[vertex]);
  double scale = 0;
  for (const uint32_t v : around) scale = std::max(scale, glm::distance(dvec3(mesh.vertices()[v]), centre));
  const TangentFrame frame = frame_about(normal);
  std::vector<dvec3> points;
  for (const uint32_t v : around) {
    const dvec3 p = (dvec3(mesh.vertices()[v]) - centre) / scale;
    points.emplace_back(glm::dot(p, frame.x), glm::dot(p, frame.y), glm::dot(p, frame.z));
  }
  // A lower degree where there are too few points, or where they leave a coefficient open.
  for (int degree = greatest_degree; degree >= 2; degree--) {
    if (points.size() < (degree == 2 ? coefficients(2) : wanted_points(degree))) continue;
    if (const auto jet = fit(points, degree)) return tensor_of(*jet, scale, frame);
  }
  return unknown;
}

double angle_between(const dvec3& a, const dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

dvec3 triangle_normal(const Mesh& mesh, std::size_t face) {
  const glm::uvec3& f = mesh.faces()[face];
  const std::array<dvec3, 3> p = {dvec3(mesh.vertices()[f.x]), dvec3(mesh.vertices()[f.y]),
                                  dvec3(mesh.vertices()[f.z])};
  dvec3 area(0.0);  // a x b + b x c + c x a without rounding, which could turn or lose a thin triangle's
  for (int x = 0; x < 3; x++) {
    const int y = (x + 1) % 3, z = (x + 2) % 3;
    ExactSum<12> component;
    for (std::size_t k = 0; k < 3; k++) {
      const dvec3 &a = p[k], &b = p[(k + 1) % 3];
      component.add_product(a[y], b[z]);
      component.add_product(-a[z], b[y]);
    }
    area[x] = component.value();
  }
  return area / std::hypot(area.x, area.y, area.z);
}

std::vector<dvec3> vertex_normals(const Mesh& mesh) {
  std::vector<dvec3> normals(mesh.vertex_count(), dvec3(0.0));
  for (std::size_t i = 0; i < mesh.face_count(); i++) {
    const glm::uvec3& face = mesh.faces()[i];
    const dvec3 normal = triangle_normal(mesh, i);
    for (int k = 0; k < 3; k++) {
      const dvec3 p(mesh.vertices()[face[k]]), next(mesh.vertices()[face[(k + 1) % 3]]),
          last(mesh.vertices()[face[(k + 2) % 3]]);
      normals[face[k]] += angle_between(next - p, last - p) * normal;
    }
  }
  for (dvec3& normal : normals) {
    const double length = glm::length(normal);
    normal = length > 1e-9 ? normal / length : dvec3(0.0);  // the angles of normals that cancel leave rounding
  }
  return normals;
}

std::vector<glm::dmat3> jet_tensors(const Mesh& mesh) {
  const std::vector<dvec3> normals = vertex_normals(mesh);
  const Neighbours neighbours(mesh);
  std::vector<glm::dmat3> tensors(mesh.vertex_count(), unknown);
  constexpr std::size_t block = 256;
  const auto states = mesh.vertex_states();
  parallel_for((mesh.vertex_count() + block - 1) / block, [&](std::size_t task) {
    for (std::size_t v = task * block; v < std::min((task + 1) * block, mesh.vertex_count()); v++) {
      const bool none = (states[v] & (vertex_non_manifold | vertex_unreferenced)) != 0 || normals[v] == dvec3(0.0);
      if (!none) tensors[v] = jet_tensor(mesh, neighbours, uint32_t(v), normals[v]);
    }
  });
  return tensors;
}

}  // namespace smurf
