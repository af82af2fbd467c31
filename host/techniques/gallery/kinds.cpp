#include "techniques/gallery/kinds.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "smurf/black_box.hpp"
#include "smurf/mesh.hpp"
#include "smurf/patch.hpp"
#include "smurf/stream.hpp"

namespace smurf {

namespace {

constexpr double pi = std::numbers::pi;

struct Swept {
  double major, minor;
  bool is_sphere() const { return major == 0; }
  glm::dvec2 angles() const { return is_sphere() ? glm::dvec2(-pi / 2, pi / 2) : glm::dvec2(-pi, pi); }
  Domain domain() const {
    const double wide = major + 1.3 * minor, high = 1.3 * minor;
    return {.lower = {-wide, -wide, -high}, .upper = {wide, wide, high}};
  }
};

Surface by_equation(const Swept& s) {
  const std::string equation = s.is_sphere() ? "x^2+y^2+z^2-r^2" : "(sqrt(x^2+y^2)-R)^2+z^2-r^2";
  return implicit(equation, s.domain(), {{"R", s.major}, {"r", s.minor}});
}

Surface by_samples(const Swept& s, int nodes) {
  const Domain domain = s.domain();
  const int high = s.is_sphere() ? nodes : std::max(8, int(nodes * domain.upper.z / domain.upper.x));
  const SampledField samples = sample_field(by_equation(s), {nodes, nodes, high}, 2);
  return isosurface(samples.volume, samples.isovalue);
}

Surface by_black_box(const Swept& s) {
  BlackBox box;
  box.source = fmt::format(
      "FN real black_box(real x, real y, real z) {{\n"
      "  real away = {};\n"
      "  return sqrt_real(away * away + z * z) - {:.9f}f;\n"
      "}}\n",
      s.is_sphere() ? "sqrt_real(x * x + y * y)" : fmt::format("sqrt_real(x * x + y * y) - {:.9f}f", s.major), s.minor);
  box.value = [s](const glm::dvec3& p) { return std::hypot(std::hypot(p.x, p.y) - s.major, p.z) - s.minor; };
  return implicit(box, s.domain(), {.lipschitz = 1});
}

Surface by_parameters(const Swept& s) {
  return parametric({"(R+r*cos(v))*cos(u)", "(R+r*cos(v))*sin(u)", "r*sin(v)"}, {0, 2 * pi}, s.angles(),
                    {{"R", s.major}, {"r", s.minor}}, {true, !s.is_sphere()});
}

Surface by_flow(const Swept& s) {
  const Domain domain = s.domain();
  const VectorField rotation = expression_flow({"-y", "x", "0"}, domain);
  // Downwards, so that x_u × x_τ points outwards.
  const SeedLine seed = seed_expression({"R+r*cos(u)", "0", "-r*sin(u)"}, s.angles(), {{"R", s.major}, {"r", s.minor}});
  return stream_surface(rotation, seed, {.time = {0, 2 * pi}});
}

// Arcs of a right angle each, as quadratic rational Bézier pieces: (x, y, w), Euclidean.
std::vector<glm::dvec3> circle_points(double from, int arcs) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i <= 2 * arcs; i++) {
    const double angle = from + i * pi / 4, stretch = i % 2 == 0 ? 1 : std::numbers::sqrt2;
    points.emplace_back(stretch * std::cos(angle), stretch * std::sin(angle), 1 / stretch);
  }
  return points;
}

std::vector<double> circle_knots(int arcs) {
  std::vector<double> knots{0};
  for (int i = 0; i <= arcs; i++) knots.insert(knots.end(), 2, i);
  knots.push_back(arcs);
  return knots;
}

Surface by_patch(const Swept& s) {
  const int arcs = s.is_sphere() ? 2 : 4;
  const std::vector<glm::dvec3> around = circle_points(0, 4), profile = circle_points(s.angles().x, arcs);
  Patch patch{.degree = {2, 2},
              .size = {int(around.size()), int(profile.size())},
              .knots = {circle_knots(4), circle_knots(arcs)},
              .points = {}};
  for (const glm::dvec3& p : profile) {
    for (const glm::dvec3& a : around) {
      const double radius = s.major + s.minor * p.x, weight = a.z * p.z;
      patch.points.emplace_back(weight * glm::dvec3(radius * a.x, radius * a.y, s.minor * p.y), weight);
    }
  }
  return nurbs({patch});
}

Mesh torus_mesh(const Swept& s, unsigned around, unsigned along) {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  for (unsigned i = 0; i < around; i++) {
    for (unsigned j = 0; j < along; j++) {
      const double u = 2 * pi * i / around, v = 2 * pi * j / along, radius = s.major + s.minor * std::cos(v);
      vertices.emplace_back(radius * std::cos(u), radius * std::sin(u), s.minor * std::sin(v));
      const auto at = [&](unsigned a, unsigned b) { return (a % around) * along + b % along; };
      faces.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      faces.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return make_mesh(vertices, faces);
}

// An octahedron whose triangles are cut into four again and again.
Mesh sphere_mesh(double radius, int levels) {
  std::vector<glm::dvec3> points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<glm::uvec3> faces{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; level++) {
    std::map<std::pair<unsigned, unsigned>, unsigned> middles;
    const auto middle = [&](unsigned a, unsigned b) {
      const auto [place, is_new] = middles.try_emplace(std::minmax(a, b), unsigned(points.size()));
      if (is_new) points.push_back(glm::normalize(points[a] + points[b]));
      return place->second;
    };
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& f : faces) {
      const unsigned a = middle(f.x, f.y), b = middle(f.y, f.z), c = middle(f.z, f.x);
      finer.insert(finer.end(), {{f.x, a, c}, {a, f.y, b}, {c, b, f.z}, {a, b, c}});
    }
    faces = std::move(finer);
  }
  std::vector<glm::vec3> vertices;
  for (const glm::dvec3& p : points) vertices.emplace_back(radius * p);
  return make_mesh(vertices, faces);
}

}  // namespace

std::vector<SurfaceOfKind> surfaces_of_every_kind(double major, double minor, int nodes) {
  const Swept swept{major, minor};
  const Mesh mesh = swept.is_sphere() ? sphere_mesh(minor, 5) : torus_mesh(swept, 160, 80);
  return {{"grid", by_samples(swept, nodes)},
          {"equation", by_equation(swept)},
          {"black box", by_black_box(swept)},
          {"parametric", by_parameters(swept)},
          {"nurbs", by_patch(swept)},
          {"stream", by_flow(swept)},
          {"mesh", mesh_surface(mesh, MeshNormals::interpolated)}};
}

}  // namespace smurf
