#include "truth/parametric.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>

#include "expression/parser.hpp"
#include "truth/sturm.hpp"

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;

double turn(double angle) { return angle < 0 ? angle + 2 * pi : angle; }

}  // namespace

std::optional<Differential> differential_of(const PatchPoint& p) {
  const dvec3 across = glm::cross(p.u, p.v);
  const double area = glm::length(across), lengths = glm::length(p.u) * glm::length(p.v);
  if (!(area > 1e-9 * lengths) || !(lengths > 0)) return std::nullopt;
  const dvec3 n = across / area;
  // In the frame e1 along x_u, e2 = n × e1: x_u = a·e1, x_v = b·e1 + c·e2. The forms are those of dn.
  const double a = glm::length(p.u), b = glm::dot(p.u, p.v) / a, c = area / a;
  const dvec3 e1 = p.u / a, e2 = glm::cross(n, e1);
  const double l = -glm::dot(n, p.uu), m = -glm::dot(n, p.uv), o = -glm::dot(n, p.vv);
  const double b11 = l / (a * a), b12 = (m - b * l / a) / (a * c),
               b22 = (b * b * l / (a * a) - 2 * b * m / a + o) / (c * c);
  Differential d;
  d.normal = n;
  d.mean = 0.5 * (b11 + b22);
  d.gauss = b11 * b22 - b12 * b12;
  const double radius = std::hypot(0.5 * (b11 - b22), b12);
  d.k1 = d.mean + radius;
  d.k2 = d.mean - radius;
  const double angle = 0.5 * std::atan2(2 * b12, b11 - b22);
  d.d1 = std::cos(angle) * e1 + std::sin(angle) * e2;
  d.d2 = glm::cross(n, d.d1);
  return d;
}

std::string ParametricScene::description() const {
  return fmt::format(R"({{"kind":"parametric","position":["{}","{}","{}"],"u":[{},{}],"v":[{},{}]{}}})"
                     "\n",
                     position[0], position[1], position[2], lower.x, upper.x, lower.y, upper.y,
                     closed[0] ? (closed[1] ? R"(,"period":["u","v"])" : R"(,"period":["u"])")
                               : (closed[1] ? R"(,"period":["v"])" : ""));
}

ParametricScene sphere_scene(double radius) {
  const std::string r = fmt::format("{}", radius);
  ParametricScene s;
  s.name = "sphere";
  s.position = {r + "*cos(v)*cos(u)", r + "*cos(v)*sin(u)", r + "*sin(v)"};
  s.lower = {0, -pi / 2};
  s.upper = {2 * pi, pi / 2};
  s.closed = {true, false};
  s.poles = {{0, -pi / 2}, {0, pi / 2}};
  s.at = points_of([radius](const Jet2& u, const Jet2& v) {
    return std::array{radius * cos(v) * cos(u), radius * cos(v) * sin(u), radius * sin(v)};
  });
  s.equation = fmt::format("x^2+y^2+z^2-{}", radius * radius);
  s.place = [](const dvec3& p) { return dvec2(turn(std::atan2(p.y, p.x)), std::atan2(p.z, std::hypot(p.x, p.y))); };
  return s;
}

ParametricScene ellipsoid_scene() {
  ParametricScene s;
  s.name = "ellipsoid";
  s.position = {"3*cos(v)*cos(u)", "2*cos(v)*sin(u)", "0.5*sin(v)"};
  s.lower = {0, -pi / 2};
  s.upper = {2 * pi, pi / 2};
  s.closed = {true, false};
  s.poles = {{0, -pi / 2}, {0, pi / 2}};
  s.at = points_of([](const Jet2& u, const Jet2& v) {
    return std::array{3 * cos(v) * cos(u), 2 * cos(v) * sin(u), 0.5 * sin(v)};
  });
  s.equation = "4*x^2+9*y^2+144*z^2-36";
  s.place = [](const dvec3& p) {
    return dvec2(turn(std::atan2(p.y / 2, p.x / 3)), std::atan2(2 * p.z, std::hypot(p.x / 3, p.y / 2)));
  };
  return s;
}

ParametricScene torus_scene(double great, double small) {
  ParametricScene s;
  s.name = "torus";
  const std::string ring = fmt::format("({}+{}*cos(v))", great, small);
  s.position = {ring + "*cos(u)", ring + "*sin(u)", fmt::format("{}*sin(v)", small)};
  s.upper = {2 * pi, 2 * pi};
  s.closed = {true, true};
  s.at = points_of([great, small](const Jet2& u, const Jet2& v) {
    return std::array{(great + small * cos(v)) * cos(u), (great + small * cos(v)) * sin(u), small * sin(v)};
  });
  s.equation = fmt::format("(x^2+y^2+z^2+{})^2-{}*(x^2+y^2)", great * great - small * small, 4 * great * great);
  s.place = [great](const dvec3& p) {
    return dvec2(turn(std::atan2(p.y, p.x)), turn(std::atan2(p.z, std::hypot(p.x, p.y) - great)));
  };
  return s;
}

ParametricScene cylinder_scene(double radius, double height) {
  ParametricScene s;
  s.name = "cylinder";
  s.position = {fmt::format("{}*cos(u)", radius), fmt::format("{}*sin(u)", radius), "v"};
  s.upper = {2 * pi, height};
  s.closed = {true, false};
  s.at = points_of([radius](const Jet2& u, const Jet2& v) { return std::array{radius * cos(u), radius * sin(u), v}; });
  s.equation = fmt::format("x^2+y^2-{}", radius * radius);
  s.place = [](const dvec3& p) { return dvec2(turn(std::atan2(p.y, p.x)), p.z); };
  return s;
}

std::vector<ParametricScene> algebraic_scenes() {
  return {sphere_scene(1.5), ellipsoid_scene(), torus_scene(2, 1), cylinder_scene(1.25, 3)};
}

ParametricScene helicoid_scene() {
  ParametricScene s;
  s.name = "helicoid";
  s.position = {"u*cos(v)", "u*sin(v)", "0.25*v"};
  s.lower = {-2, -6};
  s.upper = {2, 6};
  s.at = points_of([](const Jet2& u, const Jet2& v) { return std::array{u * cos(v), u * sin(v), 0.25 * v}; });
  return s;
}

ParametricScene enneper_scene() {
  ParametricScene s;
  s.name = "Enneper";
  s.position = {"u-u^3/3+u*v^2", "v-v^3/3+v*u^2", "u^2-v^2"};
  s.lower = {-2, -2};
  s.upper = {2, 2};
  s.at = points_of([](const Jet2& u, const Jet2& v) {
    return std::array{u - u * u * u / 3 + u * v * v, v - v * v * v / 3 + v * u * u, u * u - v * v};
  });
  return s;
}

// The figure-eight immersion: half a turn on the way around.
ParametricScene klein_scene() {
  ParametricScene s;
  s.name = "Klein bottle";
  const std::string ring = "(2+cos(u/2)*sin(v)-sin(u/2)*sin(2*v))";
  s.position = {ring + "*cos(u)", ring + "*sin(u)", "sin(u/2)*sin(v)+cos(u/2)*sin(2*v)"};
  s.upper = {2 * pi, 2 * pi};
  s.closed = {true, true};
  s.mirrored = true;
  s.at = points_of([](const Jet2& u, const Jet2& v) {
    const Jet2 c = cos(0.5 * u), n = sin(0.5 * u), ring = 2 + c * sin(v) - n * sin(2 * v);
    return std::array{ring * cos(u), ring * sin(u), n * sin(v) + c * sin(2 * v)};
  });
  return s;
}

// Apéry 1987. Half of the range of u, twice that of v: both ends of v are the one pole, each half of its surroundings.
ParametricScene boy_scene() {
  ParametricScene s;
  s.name = "Boy's surface";
  const std::string w = "/(2-sqrt(2)*sin(3*u)*sin(2*v))";
  s.position = {"(sqrt(2)*cos(2*u)*cos(v)^2+cos(u)*sin(2*v))" + w, "(sqrt(2)*sin(2*u)*cos(v)^2-sin(u)*sin(2*v))" + w,
                "3*cos(v)^2" + w};
  s.lower = {0, -pi / 2};
  s.upper = {pi, pi / 2};
  s.closed = {true, false};
  s.mirrored = true;
  s.poles = {{0, -pi / 2}, {0, pi / 2}};
  s.at = points_of([](const Jet2& u, const Jet2& v) {
    const double r = std::sqrt(2.0);
    const Jet2 w = inverse(2 - r * sin(3 * u) * sin(2 * v)), c2 = cos(v) * cos(v);
    return std::array{(r * cos(2 * u) * c2 + cos(u) * sin(2 * v)) * w, (r * sin(2 * u) * c2 - sin(u) * sin(2 * v)) * w,
                      3 * c2 * w};
  });
  return s;
}

ParametricScene pseudosphere_scene() {
  ParametricScene s;
  s.name = "pseudosphere";
  s.position = {"cos(v)/cosh(u)", "sin(v)/cosh(u)", "u-tanh(u)"};
  s.lower = {0.1, 0};
  s.upper = {3, 2 * pi};
  s.closed = {false, true};
  s.at = points_of([](const Jet2& u, const Jet2& v) {
    return std::array{cos(v) / cosh(u), sin(v) / cosh(u), u - tanh(u)};
  });
  return s;
}

std::vector<ParametricScene> other_scenes() {
  return {helicoid_scene(), enneper_scene(), klein_scene(), boy_scene(), pseudosphere_scene()};
}

Bounds sampled_bounds(const ParametricScene& scene) {
  constexpr int count = 128;
  Bounds box{dvec3(HUGE_VAL), dvec3(-HUGE_VAL)};
  for (int j = 0; j <= count; j++) {
    for (int i = 0; i <= count; i++) {
      const dvec2 at = scene.lower + (scene.upper - scene.lower) * dvec2(i, j) / double(count);
      const dvec3 p = scene.at(at.x, at.y).position;
      box.lower = glm::min(box.lower, p);
      box.upper = glm::max(box.upper, p);
    }
  }
  return box;
}

double extent_of(const Bounds& bounds) {
  const dvec3 size = bounds.upper - bounds.lower;
  return std::max({size.x, size.y, size.z});
}

// ---- Exact roots

struct AlgebraicRoots::State {
  ParametricScene scene;
  AlgebraicSurface surface;
  Domain domain;
  double extent;
};

namespace {

AlgebraicSurface algebraic_surface_of(const std::string& equation) {
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  return AlgebraicSurface(graph, expression::parse(graph, equation, variables, {}));
}

}  // namespace

AlgebraicRoots::AlgebraicRoots(const ParametricScene& scene) {
  const Bounds box = sampled_bounds(scene);
  const double extent = extent_of(box);
  // Open surfaces end with their box, closed ones lie well within it.
  const Domain domain{box.lower - dvec3(0.01 * extent), box.upper + dvec3(0.01 * extent), 0};
  state_ = std::make_shared<State>(State{scene, algebraic_surface_of(scene.equation), domain, extent});
}

ParametricRoots AlgebraicRoots::on(const Ray& ray) const {
  constexpr double near = 2e-6;  // of the extent
  const State& s = *state_;
  const dvec3 origin(ray.origin), direction(ray.direction);
  const double speed = glm::length(direction);
  const auto margin_at = [&](double t) { return near * s.extent / speed + 0x1p-22 * std::abs(t); };
  // The number of roots on the whole line, of which some are in the range of t.
  Ray line = ray;
  line.t_min = -std::numeric_limits<float>::max();
  line.t_max = std::numeric_limits<float>::max();
  const DistinctRoots found = s.surface.roots(line, part_of(s.domain, line, 0));
  ParametricRoots roots;
  roots.doubtful = found.doubtful;
  for (const double t : found.at) {
    const double margin = margin_at(t);
    if (t < ray.t_min - margin || t > ray.t_max + margin) continue;
    bool certain = t > ray.t_min + margin && t < ray.t_max - margin;
    const dvec2 place = s.scene.place(origin + t * direction);
    bool inside = true;
    const PatchPoint at = s.scene.at(place.x, place.y);
    for (int axis = 0; axis < 2; axis++) {
      if (s.scene.closed[std::size_t(axis)] || !s.scene.poles.empty()) continue;
      // Where a ray runs along the surface, its place there is less certain.
      const double slope = std::abs(glm::dot(glm::normalize(glm::cross(at.u, at.v)), direction / speed));
      const double off = near * s.extent / glm::length(axis == 0 ? at.u : at.v) / std::max(slope, 1e-3);
      inside = inside && place[axis] > s.scene.lower[axis] - off && place[axis] < s.scene.upper[axis] + off;
      certain = certain && place[axis] > s.scene.lower[axis] + off && place[axis] < s.scene.upper[axis] - off;
    }
    if (inside) roots.at.push_back({t, place, certain});
  }
  return roots;
}

double distance_on(const ParametricScene& scene, const dvec2& a, const dvec2& b) {
  const PatchPoint at = scene.at(b.x, b.y);
  dvec2 off = glm::abs(a - b);
  const dvec2 range = scene.upper - scene.lower;
  bool at_seam = false;
  for (int axis = 0; axis < 2; axis++) {
    if (!scene.closed[std::size_t(axis)]) continue;
    off[axis] = std::min(off[axis], std::abs(range[axis] - off[axis]));
    at_seam = at_seam || std::min(b[axis] - scene.lower[axis], scene.upper[axis] - b[axis]) < 1e-4 * range[axis];
  }
  const double way = off.x * glm::length(at.u) + off.y * glm::length(at.v);
  const double straight = glm::distance(scene.at(a.x, a.y).position, at.position);
  // At a pole differences of the coordinate that is free there are as long as one likes.
  const bool at_pole = std::ranges::any_of(scene.poles, [&](const dvec2& pole) {
    return glm::distance(scene.at(pole.x, pole.y).position, at.position) < 1e-3 * glm::length(at.v) * range.y;
  });
  return at_pole || (at_seam && scene.mirrored) ? straight : std::max(way, straight);
}

}  // namespace smurf::test
