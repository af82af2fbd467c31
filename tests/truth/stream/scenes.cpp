#include "truth/stream/scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "truth/jet2.hpp"

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;
constexpr double longer = 0.01;  // of the ranges, by which places may lie beyond them

Jet2 exponential(const Jet2& a) {
  const double e = std::exp(a.value);
  return chained(a, e, e, e);
}

bool is_near(const StreamScene& scene, const dvec2& place) {
  const double u = longer * (scene.range.y - scene.range.x), time = longer * (scene.time.y - scene.time.x);
  return place.x > scene.range.x - u && place.x < scene.range.y + u && place.y > scene.time.x - time &&
         place.y < scene.time.y + time;
}

dvec3 on(const Ray& ray, double t) { return dvec3(ray.origin) + t * dvec3(ray.direction); }

// Of a surface on which a polynomial in x, y and z vanishes; `preimages` are places of a point of it.
std::function<StreamPlaces(const Ray&)> algebraic(const StreamScene& scene, const std::string& equation,
                                                  std::function<std::vector<dvec2>(const dvec3&)> preimages) {
  ParametricScene whole = scene.parametric();
  whole.equation = equation;
  whole.closed = {true, true};  // borders are looked at by those who ask
  whole.place = [range = scene.range, time = scene.time](const dvec3&) { return dvec2(range.x, time.x); };
  const auto roots = std::make_shared<AlgebraicRoots>(whole);
  StreamScene frame = scene;
  return [roots, frame, preimages](const Ray& ray) {
    Ray line = ray;
    line.t_min = -3e38f;
    line.t_max = 3e38f;
    const ParametricRoots found = roots->on(line);
    StreamPlaces places;
    places.doubtful = found.doubtful;
    for (const ParametricRoot& root : found.at)
      for (const dvec2& place : preimages(on(ray, root.t)))
        if (is_near(frame, place)) places.at.push_back({root.t, place});
    return places;
  };
}

// Where f is 0 in [low, high], in which it is monotone.
template <class F>
double bisect(const F& f, double low, double high) {
  const bool rising = f(high) > f(low);
  for (int i = 0; i < 100; i++) {
    const double middle = 0.5 * (low + high);
    ((f(middle) > 0) == rising ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

// The angle of the ray's points about the z axis less that of the surface, τ(t) = z(t)/c, is monotone but where
// ρ² = h c / dz, h the angular momentum of the ray; the surface is met where it is a multiple of π.
StreamPlaces helicoid_places(const StreamScene& scene, double c, const Ray& ray) {
  StreamPlaces places;
  const dvec3 o(ray.origin), d(ray.direction);
  const auto add = [&](double t, double time) {
    const dvec3 p = on(ray, t);
    const dvec2 place(std::cos(time) * p.x + std::sin(time) * p.y, time);
    if (is_near(scene, place)) places.at.push_back({t, place});
  };
  const double across = d.x * d.x + d.y * d.y, size = glm::dot(d, d);
  if (std::abs(d.z) < 1e-12 * std::sqrt(size)) {
    const double time = o.z / c, sine = std::sin(time), cosine = std::cos(time);
    const double slope = cosine * d.y - sine * d.x;
    places.doubtful = std::abs(slope) < 1e-9 * std::sqrt(size);
    if (!places.doubtful) add((sine * o.x - cosine * o.y) / slope, time);
    return places;
  }
  const double slack = longer * (scene.time.y - scene.time.x);
  double first = (c * (scene.time.x - slack) - o.z) / d.z, last = (c * (scene.time.y + slack) - o.z) / d.z;
  if (first > last) std::swap(first, last);
  const double h = o.x * d.y - o.y * d.x, middle = across > 0 ? -(o.x * d.x + o.y * d.y) / across : 0;
  const double nearest = across > 0 ? std::abs(h) / std::sqrt(across) : std::hypot(o.x, o.y);
  if (nearest < 1e-9) {
    places.doubtful = true;
    return places;
  }
  const auto excess = [&](double t) {
    const dvec3 p = on(ray, t), foot = on(ray, middle);
    const double turned = across > 0 ? std::atan((t - middle) * across / h) : 0;
    return std::atan2(foot.y, foot.x) + turned - p.z / c;
  };
  std::vector<double> ends{first, last};
  if (across > 0 && h * c / d.z > nearest * nearest) {
    const double half = std::sqrt((h * c / d.z - nearest * nearest) / across);
    for (const double t : {middle - half, middle + half})
      if (t > first && t < last) ends.push_back(t);
  }
  std::ranges::sort(ends);
  for (std::size_t i = 0; i + 1 < ends.size(); i++) {
    const double low = excess(ends[i]), high = excess(ends[i + 1]);
    for (double k = std::ceil(std::min(low, high) / pi); k <= std::max(low, high) / pi; k++) {
      const double t = bisect([&](double s) { return excess(s) - k * pi; }, ends[i], ends[i + 1]);
      add(t, on(ray, t).z / c);
    }
    // Two roots that are one, or about to be.
    const double off = std::abs(low / pi - std::round(low / pi));
    if (i > 0 && off < 1e-11) places.doubtful = true;
  }
  return places;
}

// A ruled surface: e(τ) (p + u q). The determinant of the ray's direction, the ruling and what is between their points
// is a function of τ alone, looked at between 4096 places and where it is stationary between them.
StreamPlaces ruled_places(const StreamScene& scene, const Ray& ray) {
  StreamPlaces places;
  const dvec3 o(ray.origin), d(ray.direction);
  const auto value = [&](double time) {
    const PatchPoint p = scene.at(0, time);
    return glm::dot(d, glm::cross(p.u, p.position - o));
  };
  const auto slope = [&](double time) {
    const PatchPoint p = scene.at(0, time);
    return glm::dot(d, glm::cross(p.uv, p.position - o)) + glm::dot(d, glm::cross(p.u, p.v));
  };
  const auto add = [&](double time) {
    const PatchPoint p = scene.at(0, time);
    // o + t d = p + u q in the plane of both.
    const dvec3 normal = glm::cross(d, p.u);
    const double square = glm::dot(normal, normal);
    if (!(square > 1e-20 * glm::dot(d, d) * glm::dot(p.u, p.u))) {
      places.doubtful = true;
      return;
    }
    const dvec3 off = p.position - o;
    const double t = glm::dot(glm::cross(off, p.u), normal) / square, u = glm::dot(glm::cross(off, d), normal) / square;
    if (is_near(scene, {u, time})) places.at.push_back({t, {u, time}});
  };
  constexpr int parts = 4096;
  const double slack = longer * (scene.time.y - scene.time.x), low = scene.time.x - slack,
               step = (scene.time.y + slack - low) / parts;
  double size = 0;
  for (int i = 0; i <= parts; i++) size = std::max(size, std::abs(value(low + step * i)));
  const auto between = [&](double a, double b) {
    const double fa = value(a), fb = value(b);
    if ((fa > 0) != (fb > 0)) add(bisect(value, a, b));
  };
  for (int i = 0; i < parts; i++) {
    const double a = low + step * i, b = a + step;
    if ((slope(a) > 0) == (slope(b) > 0)) {
      between(a, b);
      continue;
    }
    const double turn = bisect(slope, a, b);
    if (std::abs(value(turn)) < 1e-13 * size) places.doubtful = true;
    between(a, turn);
    between(turn, b);
  }
  return places;
}

double turned(const dvec3& p) {
  const double angle = std::atan2(p.y, p.x);
  return angle < 0 ? angle + 2 * pi : angle;
}

constexpr double pitch = 0.3, growth = 0.1, decay = 0.3, bend = 0.8;

StreamScene any_graph() {
  StreamScene s;
  s.vector = {"1", "0", fmt::format("{}*y^2", bend)};
  s.domain = {dvec3(-1.3, -1.3, -2.2), dvec3(1.3, 1.3, 2.2)};
  return s;
}

}  // namespace

ParametricScene StreamScene::parametric() const {
  ParametricScene p;
  p.name = name;
  p.lower = {range.x, time.x};
  p.upper = {range.y, time.y};
  p.at = at;
  p.closed = closed;
  return p;
}

Surface StreamScene::surface(StreamOptions options) const {
  options.time = time;
  return stream_surface(field(), seeds(), options);
}

std::string StreamScene::description(StreamMethod method) const {
  std::string curve;
  for (const dvec3& p : points) curve += fmt::format("{}[{},{},{}]", curve.empty() ? "" : ",", p.x, p.y, p.z);
  curve = points.empty()
              ? fmt::format(R"("position":["{}","{}","{}"],"u":[{},{}])", seed[0], seed[1], seed[2], range.x, range.y)
              : fmt::format(R"("points":[{}])", curve);
  return fmt::format(
      R"({{"kind":"stream","time":[{},{}],"method":"{}","field":{{"kind":"expression","vector":["{}","{}","{}"],)"
      R"("domain":[[{},{},{}],[{},{},{}]]}},"seed":{{{}}}}})"
      "\n",
      time.x, time.y, method == StreamMethod::mesh ? "explicit" : "back-stream", vector[0], vector[1], vector[2],
      domain.lower.x, domain.lower.y, domain.lower.z, domain.upper.x, domain.upper.y, domain.upper.z, curve);
}

StreamScene helicoid_stream(const dvec2& time) {
  StreamScene s;
  s.name = fmt::format("helicoid [{}, {}]", time.x, time.y);
  s.vector = {"-y", "x", fmt::format("{}", pitch)};
  s.domain = {dvec3(-1.3, -1.3, pitch * std::min(0.0, time.x) - 0.1),
              dvec3(1.3, 1.3, pitch * std::max(0.0, time.y) + 0.1)};
  s.seed = {"u", "0", "0"};
  s.range = {0.2, 1.2};
  s.time = time;
  s.at = points_of([](const Jet2& u, const Jet2& t) { return std::array{u * cos(t), u * sin(t), pitch * t}; });
  s.places = [frame = s](const Ray& ray) { return helicoid_places(frame, pitch, ray); };
  return s;
}

VectorField helicoid_on_grid(const glm::ivec3& size, VectorReconstruction reconstruction, const dvec2& time) {
  const Domain domain = helicoid_stream(time).domain;
  const dvec3 step = (domain.upper - domain.lower) / dvec3(size - 1);
  VectorGrid grid{size, spacing(step.x, step.y, step.z), {}};
  grid.placement.origin = domain.lower;
  for (int i = 0; i < size.x * size.y * size.z; i++) {
    const dvec3 p = domain.lower + step * dvec3(i % size.x, i / size.x % size.y, i / size.x / size.y);
    grid.vectors.emplace_back(-p.y, p.x, pitch);
  }
  return grid_flow(std::move(grid), reconstruction);
}

StreamScene graph_stream() {
  StreamScene s = any_graph();
  s.name = "graph";
  s.seed = {"0", "u", "0"};
  s.range = {-1, 1};
  s.time = {-1, 1.2};
  s.at = points_of([](const Jet2& u, const Jet2& t) { return std::array{t, u, bend * t * u * u}; });
  s.places = algebraic(s, fmt::format("z-{}*x*y^2", bend), [](const dvec3& p) { return std::vector{dvec2(p.y, p.x)}; });
  return s;
}

// c(u) = (0, u - 1, |u - 1| / 2) for u in [0, 2]: z = |y| / 2 + k x y².
StreamScene corner_stream() {
  StreamScene s = any_graph();
  s.name = "corner";
  s.points = {{0, -1, 0.5}, {0, 0, 0}, {0, 1, 0.5}};
  s.range = {0, 2};
  s.time = {0, 1.2};
  s.at = points_of([](const Jet2& u, const Jet2& t) {
    const Jet2 y = u - 1;
    return std::array{t, y, (u.value < 1 ? -0.5 : 0.5) * y + bend * t * y * y};
  });
  const auto half = [&](double sign) {
    return algebraic(s, fmt::format("z-({})*y-{}*x*y^2", 0.5 * sign, bend), [sign](const dvec3& p) {
      // The corner itself belongs to the right.
      if (sign > 0 ? p.y < 0 : p.y >= 0) return std::vector<dvec2>{};
      return std::vector{dvec2(p.y + 1, p.x)};
    });
  };
  s.places = [left = half(-1), right = half(1)](const Ray& ray) {
    StreamPlaces places = left(ray), others = right(ray);
    places.at.insert(places.at.end(), others.at.begin(), others.at.end());
    places.doubtful = places.doubtful || others.doubtful;
    return places;
  };
  return s;
}

StreamScene cut_stream() {
  StreamScene s = graph_stream();
  s.name = "cut graph";
  s.domain.upper = {1.3, 1.3, 0.4};
  s.time = {0, 1.2};
  s.leaves = [](double u) { return 0.4 / (bend * u * u); };
  s.places = algebraic(s, fmt::format("z-{}*x*y^2", bend), [](const dvec3& p) { return std::vector{dvec2(p.y, p.x)}; });
  return s;
}

StreamScene torus_stream(double turns) {
  StreamScene s;
  s.name = fmt::format("torus, {} turns", turns);
  s.vector = {"-y", "x", "0"};
  s.domain = {dvec3(-3.2, -3.2, -1.2), dvec3(3.2, 3.2, 1.2)};
  s.seed = {"2+cos(u)", "0", "sin(u)"};
  s.range = {0, 2 * pi};
  s.time = {0, turns * 2 * pi};
  s.closed = {true, turns == 1};
  s.at = points_of([](const Jet2& u, const Jet2& t) {
    const Jet2 ring = 2 + cos(u);
    return std::array{ring * cos(t), ring * sin(t), sin(u)};
  });
  const bool once = turns == 1;
  s.places = algebraic(s, "(x^2+y^2+z^2+3)^2-16*(x^2+y^2)", [once](const dvec3& p) {
    double u = std::atan2(p.z, std::hypot(p.x, p.y) - 2);
    if (u < 0) u += 2 * pi;
    // After a whole turn the seam is one place.
    if (once) return std::vector{dvec2(u, turned(p))};
    std::vector<dvec2> places;
    for (double time = turned(p) - 2 * pi; time < 100; time += 2 * pi) places.emplace_back(u, time);
    return places;
  });
  return s;
}

StreamScene spiral_stream() {
  StreamScene s;
  s.name = "spiral";
  s.vector = {fmt::format("{}*x-y", growth), fmt::format("x+{}*y", growth), fmt::format("-{}*z", decay)};
  s.domain = {dvec3(-2.2, -2.2, 0), dvec3(2.2, 2.2, 2)};
  s.seed = {"0.3+u", "0", "1+0.2*u"};
  s.range = {0, 1};
  s.time = {-1, 4};
  s.at = points_of([](const Jet2& u, const Jet2& t) {
    const Jet2 r = (0.3 + u) * exponential(growth * t);
    return std::array{r * cos(t), r * sin(t), (1 + 0.2 * u) * exponential(-decay * t)};
  });
  s.places = [frame = s](const Ray& ray) { return ruled_places(frame, ray); };
  return s;
}

StreamScene swirl_stream() {
  StreamScene s;
  s.name = "swirl";
  s.vector = {"-y*(1+x^2+y^2)", "x*(1+x^2+y^2)", "0.2*x"};
  s.domain = {dvec3(-1.3), dvec3(1.3)};
  s.seed = {"u", "0", "0"};
  s.range = {0.2, 1.2};
  s.time = {0, 4};
  s.at = points_of([](const Jet2& u, const Jet2& t) {
    const Jet2 w = 1 + u * u, y = u * sin(w * t);
    return std::array{u * cos(w * t), y, 0.2 * y / w};
  });
  s.places = algebraic(s, "z*(1+x^2+y^2)-0.2*y", [](const dvec3& p) {
    const double u = std::hypot(p.x, p.y), w = 1 + u * u;
    std::vector<dvec2> places;
    for (double angle = turned(p) - 2 * pi; angle < 5 * w; angle += 2 * pi) places.emplace_back(u, angle / w);
    return places;
  });
  return s;
}

std::vector<StreamScene> stream_scenes() {
  return {helicoid_stream(), helicoid_stream({1, 2}), helicoid_stream({-3, 2}), graph_stream(),  corner_stream(),
          cut_stream(),      torus_stream(1),         torus_stream(1.25),       spiral_stream(), swirl_stream()};
}

ParametricRoots roots_on(const StreamScene& scene, const ParametricScene& parametric, double extent, double near,
                         const Ray& ray) {
  const StreamPlaces found = scene.places(ray);
  const dvec3 direction(ray.direction);
  const double speed = glm::length(direction);
  ParametricRoots roots;
  roots.doubtful = found.doubtful;
  for (const auto& [t, place] : found.at) {
    const double margin = near * extent / speed + 0x1p-22 * std::abs(t);
    if (t < ray.t_min - margin || t > ray.t_max + margin) continue;
    bool certain = t > ray.t_min + margin && t < ray.t_max - margin, inside = true;
    const PatchPoint at = scene.at(place.x, place.y);
    const double slope = std::abs(glm::dot(glm::normalize(glm::cross(at.u, at.v)), direction / speed));
    // Where a ray runs along the surface, its place there is less certain.
    const double off = near * extent / std::max(slope, 1e-3);
    const auto border = [&](double beyond, double size) {
      inside = inside && beyond < off / size;
      certain = certain && beyond < -off / size;
    };
    for (int axis = 0; axis < 2; axis++) {
      if (scene.closed[std::size_t(axis)]) continue;
      const double size = glm::length(axis == 0 ? at.u : at.v);
      border(parametric.lower[axis] - place[axis], size);
      border(place[axis] - parametric.upper[axis], size);
    }
    if (scene.leaves) border(place.y - scene.leaves(place.x), glm::length(at.v));
    // At a corner of the seed curve a ray may pass by where it seems to hit.
    for (std::size_t i = 1; i + 1 < scene.points.size(); i++)
      certain = certain && std::abs(place.x - double(i)) > off / glm::length(at.u);
    if (inside) roots.at.push_back({t, place, certain});
  }
  std::ranges::sort(roots.at, {}, &ParametricRoot::t);
  return roots;
}

Surface StreamInvariant::surface(StreamOptions options) const {
  options.time = time;
  return stream_surface(expression_flow(vector, domain), seed_expression(seed, range), options);
}

std::vector<StreamInvariant> stream_invariants() {
  std::vector<StreamInvariant> all;
  // Hill's vortex: Stokes' stream function -3/4 ρ² (1 - ρ² - z²) from a circle about the axis.
  const double ring = 0.5, hill = ring * ring * (1 - ring * ring);
  all.push_back({"Hill's vortex",
                 {"-1.5*x*z", "-1.5*y*z", "-1.5*(1-2*(x^2+y^2)-z^2)"},
                 {dvec3(-1.1), dvec3(1.1)},
                 {fmt::format("{}*cos(u)", ring), fmt::format("{}*sin(u)", ring), "0"},
                 {0, 2 * pi},
                 {0, 3},
                 2,
                 [hill](const dvec3& p) {
                   const double r2 = p.x * p.x + p.y * p.y;
                   return r2 * (1 - r2 - p.z * p.z) - hill;
                 },
                 [](const dvec3& p) {
                   const double r2 = p.x * p.x + p.y * p.y, by_r2 = 1 - 2 * r2 - p.z * p.z;
                   return dvec3(2 * p.x * by_r2, 2 * p.y * by_r2, -2 * r2 * p.z);
                 }});
  // Potential flow past the unit cylinder: ψ = y (1 - 1/ρ²), from a line along the cylinder.
  const double start = 0.6 * (1 - 1 / (16 + 0.36));
  all.push_back({"cylinder",
                 {"1-(x^2-y^2)/(x^2+y^2)^2", "-2*x*y/(x^2+y^2)^2", "0.05"},
                 {dvec3(-6, -6, -1.5), dvec3(6, 6, 1.5)},
                 {"-4", "0.6", "u"},
                 {-1, 1},
                 {0, 8},
                 8,
                 [start](const dvec3& p) { return p.y * (1 - 1 / (p.x * p.x + p.y * p.y)) - start; },
                 [](const dvec3& p) {
                   const double r2 = p.x * p.x + p.y * p.y;
                   return dvec3(2 * p.x * p.y / (r2 * r2), 1 - 1 / r2 + 2 * p.y * p.y / (r2 * r2), 0);
                 }});
  return all;
}

}  // namespace smurf::test
