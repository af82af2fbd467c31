#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "truth/parametric_rays.hpp"

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

class SceneRays {
 public:
  SceneRays(const RaySources& sources, unsigned seed) : sources_(sources), random_(seed) {
    diagonal_ = glm::length(box().upper - box().lower);
  }

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  dvec3 direction() {
    const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
  dvec3 axis() {
    dvec3 d(0.0);
    d[integer(0, 2)] = integer(0, 1) == 0 ? 1 : -1;
    return d;
  }
  dvec3 in_box() {
    return box().lower + (box().upper - box().lower) * dvec3(uniform(0, 1), uniform(0, 1), uniform(0, 1));
  }
  // Where parameters end; of four, one is at a corner.
  PatchPoint at_border() {
    const double side = uniform(0, 1), along = integer(0, 3) == 0 ? integer(0, 1) : uniform(0, 1);
    return sources_.border(side, along);
  }
  PatchPoint regular_point() {
    while (true) {
      const double a = uniform(0, 1), b = uniform(0, 1);
      const PatchPoint p = sources_.anywhere(a, b);
      if (differential_of(p)) return p;
    }
  }
  dvec3 pole() { return sources_.poles[std::size_t(integer(0, int(sources_.poles.size()) - 1))]; }
  dvec3 tangent(const PatchPoint& p) {
    const double angle = uniform(0, 2 * std::numbers::pi);
    const dvec3 e1 = glm::normalize(p.u), e2 = glm::normalize(glm::cross(glm::cross(p.u, p.v), p.u));
    return std::cos(angle) * e1 + std::sin(angle) * e2;
  }
  // From outside, by a direction of any usual length.
  Ray through(const dvec3& point, const dvec3& direction) {
    const dvec3 d = glm::normalize(direction);
    return {glm::vec3(point - 1.5 * diagonal_ * d), glm::vec3(uniform(0.5, 2) * d)};
  }
  double diagonal() const { return diagonal_; }
  const Bounds& box() const { return sources_.box; }
  const RaySources& sources() const { return sources_; }

 private:
  const RaySources& sources_;
  double diagonal_ = 0;
  std::mt19937 random_;
};

template <class Make>
RayFamily family(const char* name, std::size_t count, Make make) {
  RayFamily out{name, RayBatch(count)};
  for (std::size_t i = 0; i < count; i++) out.rays.set(i, make());
  return out;
}

RayFamily cameras(SceneRays& random, std::size_t count) {
  constexpr std::size_t width = 32;
  RayFamily out{"camera", RayBatch((count + width - 1) / width * width), true};
  out.rays.image_width = width;
  dvec3 eye(0.0), right(0.0), up(0.0), forward(0.0);
  const dvec3 centre = 0.5 * (random.box().lower + random.box().upper);
  for (std::size_t i = 0; i < out.rays.size(); i++) {
    if (i % (width * width) == 0) {
      forward = random.direction();
      eye = centre - 1.3 * random.diagonal() * forward;
      right = glm::normalize(glm::cross(forward, random.direction()));
      up = glm::cross(right, forward);
    }
    const double x = (double(i % width) + 0.5) / width - 0.5, y = (double(i / width % width) + 0.5) / width - 0.5;
    out.rays.set(i, {glm::vec3(eye), glm::vec3(glm::normalize(forward + 0.8 * (x * right + y * up)))});
  }
  return out;
}

RayFamily invalid_rays(SceneRays& random, std::size_t count) {
  std::size_t next = 0;
  RayFamily out = family("not finite, no direction, or empty range", count,
                         [&] { return spoiled(random.through(random.in_box(), random.direction()), next++); });
  out.valid = false;
  return out;
}

// Rays that meet the surface where its parameters end or have no meaning.
void add_border_families(std::vector<RayFamily>& out, SceneRays& random, std::size_t count) {
  if (!random.sources().poles.empty()) {
    out.push_back(family("through poles", count, [&] { return random.through(random.pole(), random.direction()); }));
    out.push_back(family("through poles, along an axis", count / 4,
                         [&] { return random.through(random.pole(), random.axis()); }));
    out.push_back(family("near poles", count, [&] {
      const double away = random.diagonal() * std::pow(10.0, random.uniform(-8, -2));
      return random.through(random.pole() + away * random.direction(), random.direction());
    }));
  }
  out.push_back(family("at seams and borders", count,
                       [&] { return random.through(random.at_border().position, random.direction()); }));
  out.push_back(family("near seams and borders", count, [&] {
    const double away = random.diagonal() * std::pow(10.0, random.uniform(-8, -3));
    return random.through(random.at_border().position + away * random.direction(), random.direction());
  }));
  out.push_back(family("from seam to seam", count, [&] {
    const dvec3 from = random.at_border().position, to = random.at_border().position;
    return random.through(from, glm::distance(from, to) > 1e-3 * random.diagonal() ? to - from : random.direction());
  }));
  out.push_back(family("along seams and borders", count, [&] {
    const PatchPoint p = random.at_border();
    const dvec3 along = random.integer(0, 1) == 0 ? p.u : p.v;
    return random.through(p.position, glm::length(along) > 1e-6 ? along : random.direction());
  }));
}

void add_plane_families(std::vector<RayFamily>& out, SceneRays& random, std::size_t count) {
  out.push_back(family("along an axis", count, [&] { return random.through(random.in_box(), random.axis()); }));
  out.push_back(family("along an axis, at a point of the surface", count,
                       [&] { return random.through(random.regular_point().position, random.axis()); }));
  out.push_back(family("in a plane of symmetry", count, [&] {
    const int axis = random.integer(0, 2);
    dvec3 p = random.in_box(), d = random.direction();
    p[axis] = d[axis] = 0;
    if (random.integer(0, 7) == 0) p[(axis + 1) % 3] = 0;
    return random.through(p, d);
  }));
  out.push_back(
      family("in the origin's axes", count / 8 + 3, [&] { return random.through(dvec3(0.0), random.axis()); }));
}

void add_extent_families(std::vector<RayFamily>& out, SceneRays& random, std::size_t count) {
  out.push_back(family("tangent", count, [&] {
    const PatchPoint p = random.regular_point();
    return random.through(p.position, random.tangent(p));
  }));
  out.push_back(family("nearly tangent", count, [&] {
    const PatchPoint p = random.regular_point();
    const dvec3 normal = glm::normalize(glm::cross(p.u, p.v));
    const double off = random.diagonal() * std::pow(10.0, random.uniform(-7, -3));
    return random.through(p.position - off * normal, random.tangent(p));
  }));
  out.push_back(family("from inside", count, [&] {
    return Ray{glm::vec3(random.in_box()), glm::vec3(random.direction())};
  }));
  out.push_back(family("from the surface", count, [&] {
    return Ray{glm::vec3(random.regular_point().position), glm::vec3(random.direction())};
  }));
  out.push_back(family("behind the origin", count, [&] {
    return Ray{glm::vec3(random.in_box()), glm::vec3(random.direction()), float(-2 * random.diagonal())};
  }));
  out.push_back(family("from far away", count, [&] {
    const dvec3 p = random.regular_point().position, d = random.direction();
    return Ray{glm::vec3(p - 1e4 * random.diagonal() * d), glm::vec3(random.uniform(0.5, 2) * d)};
  }));
  out.push_back(family("window of t", count, [&] {
    Ray ray = random.through(random.in_box(), random.direction());
    const double middle = random.uniform(1, 2) * random.diagonal(), half = random.uniform(0, 0.3) * random.diagonal();
    ray.direction = glm::normalize(ray.direction);
    ray.t_min = float(middle - half);
    ray.t_max = float(middle + half);
    return ray;
  }));
  out.push_back(family("to the surface", count, [&] {
    const dvec3 d = random.direction() * random.diagonal();
    return Ray{glm::vec3(random.regular_point().position - d), glm::vec3(d), 0.0f, 1.0f};
  }));
  out.push_back(family("long and short directions", count, [&] {
    Ray ray = random.through(random.in_box(), random.direction());
    ray.direction *= float(std::pow(10.0, random.uniform(-9, 9)));
    return ray;
  }));
}

}  // namespace

RaySources sources_of(const ParametricScene& scene) {
  RaySources sources;
  sources.box = sampled_bounds(scene);
  sources.anywhere = [scene](double a, double b) {
    const dvec2 at = scene.lower + (scene.upper - scene.lower) * dvec2(a, b);
    return scene.at(at.x, at.y);
  };
  sources.border = [scene](double which, double along) {
    const int side = std::min(3, int(4 * which)), fixed = side / 2;
    dvec2 at = scene.lower + (scene.upper - scene.lower) * along;
    at[fixed] = side % 2 == 0 ? scene.lower[fixed] : scene.upper[fixed];
    return scene.at(at.x, at.y);
  };
  for (const dvec2& pole : scene.poles) sources.poles.push_back(scene.at(pole.x, pole.y).position);
  return sources;
}

RaySources sources_of(const std::vector<Patch>& patches) {
  const double count = double(patches.size());
  const auto number = [=](double part) { return std::min(patches.size() - 1, std::size_t(part * count)); };
  RaySources sources;
  sources.anywhere = [=](double a, double b) {
    const std::size_t patch = number(a);
    const Patch& p = patches[patch];
    const double u = std::clamp(a * count - double(patch), 0.0, 1.0);
    return point_of(p, p.lower(0) + u * (p.upper(0) - p.lower(0)), p.lower(1) + b * (p.upper(1) - p.lower(1)));
  };
  sources.border = [=](double which, double along) {
    const std::size_t patch = number(which);
    const int side = std::clamp(int(4 * (which * count - double(patch))), 0, 3);
    const dvec2 at = Side{patch, side}.place(patches, along);
    return point_of(patches[patch], at.x, at.y);
  };
  sources.box = {dvec3(HUGE_VAL), dvec3(-HUGE_VAL)};
  constexpr int samples = 16;
  for (const Patch& p : patches) {
    for (int k = 0; k < (samples + 1) * (samples + 1); k++) {
      const double a = double(k % (samples + 1)) / samples, b = double(k / (samples + 1)) / samples;
      const dvec3 at =
          point_of(p, p.lower(0) + a * (p.upper(0) - p.lower(0)), p.lower(1) + b * (p.upper(1) - p.lower(1))).position;
      sources.box.lower = glm::min(sources.box.lower, at);
      sources.box.upper = glm::max(sources.box.upper, at);
    }
  }
  for (const Side& side : collapsed_sides(patches, 1e-9 * extent_of(sources.box))) {
    const dvec2 at = side.place(patches, 0);
    sources.poles.push_back(point_of(patches[side.patch], at.x, at.y).position);
  }
  return sources;
}

std::vector<RayFamily> parametric_families(const RaySources& sources, std::size_t random_rays, std::size_t hostile,
                                           unsigned seed) {
  SceneRays random(sources, seed);
  std::vector<RayFamily> out;
  RayFamily chords = family("chords", random_rays, [&] {
    const dvec3 a = random.in_box(), b = random.in_box();
    return random.through(a, glm::distance(a, b) > 1e-3 * random.diagonal() ? b - a : random.direction());
  });
  chords.random = true;
  out.push_back(std::move(chords));
  out.push_back(cameras(random, random_rays));
  add_border_families(out, random, hostile);
  add_plane_families(out, random, hostile);
  add_extent_families(out, random, hostile);
  out.push_back(invalid_rays(random, 22));
  return out;
}

}  // namespace smurf::test
