#include "truth/rays.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace smurf::test {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

class RandomRays {
 public:
  RandomRays(const GridFrame& frame, unsigned seed) : frame_(frame), random_(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  bool coin() { return integer(0, 1) == 1; }

  glm::dvec3 point() {  // of the domain, in index coordinates
    return glm::dvec3(uniform(0, 1), uniform(0, 1), uniform(0, 1)) * frame_.last();
  }
  glm::dvec3 node() {
    return {integer(0, frame_.size.x - 1), integer(0, frame_.size.y - 1), integer(0, frame_.size.z - 1)};
  }
  glm::dvec3 direction() {
    const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
  glm::dvec3 axis() {
    glm::dvec3 d(0.0);
    d[integer(0, 2)] = coin() ? 1 : -1;
    return d;
  }
  // Length in index coordinates from a point inside to outside of the domain.
  double reach() const { return glm::length(frame_.last()) + 2; }

  // The ray through an index point along an index direction, from outside of the domain.
  Ray through(const glm::dvec3& point, const glm::dvec3& direction) {
    return placed(point - direction / glm::length(direction) * reach(), direction);
  }
  Ray placed(const glm::dvec3& origin, const glm::dvec3& direction) {
    return {glm::vec3(frame_.to_world(origin)), glm::vec3(frame_.placement.axes * direction)};
  }

 private:
  GridFrame frame_;
  std::mt19937 random_;
};

RayFamily family(const char* name, std::size_t count, const std::function<Ray()>& make) {
  RayFamily out{name, RayBatch(count)};
  for (std::size_t i = 0; i < count; i++) out.rays.set(i, make());
  return out;
}

glm::dvec3 any_tangent(const glm::dvec3& normal, RandomRays& random) {
  while (true) {
    const glm::dvec3 d = random.direction();
    const glm::dvec3 tangent = d - glm::dot(d, normal) * normal;
    if (glm::length(tangent) > 0.1) return glm::normalize(tangent);
  }
}

// Rays that lie in, or graze, the structure of the grid.
void add_grid_families(std::vector<RayFamily>& out, const GridFrame& frame, RandomRays& random, std::size_t count) {
  out.push_back(family("along an axis", count, [&] { return random.through(random.point(), random.axis()); }));
  out.push_back(family("in a cell face", count, [&] {
    const int axis = random.integer(0, 2);
    glm::dvec3 p = random.point(), d = random.direction();
    p[axis] = random.node()[axis];
    d[axis] = 0;
    return random.through(p, d);
  }));
  out.push_back(family("along a cell edge", count, [&] { return random.through(random.node(), random.axis()); }));
  out.push_back(family("in a boundary face", count, [&] {
    const int axis = random.integer(0, 2);
    glm::dvec3 p = random.point(), d = random.direction();
    p[axis] = random.coin() ? 0 : frame.last()[axis];
    d[axis] = 0;
    return random.through(p, d);
  }));
  out.push_back(family("through nodes", count, [&] { return random.through(random.node(), random.direction()); }));
  out.push_back(family("diagonal through nodes", count, [&] {
    const glm::dvec3 d(random.integer(-1, 1), random.integer(-1, 1), random.coin() ? 1 : -1);
    return random.through(random.node(), d);
  }));
  out.push_back(family("from a node", count, [&] { return random.placed(random.node(), random.direction()); }));
  out.push_back(family("nearly along an axis", count, [&] {
    const double tilt = std::pow(10.0, random.uniform(-12, -2));
    return random.through(random.point(), random.axis() + tilt * random.direction());
  }));
}

// Rays whose extent or numbers are unusual.
void add_extent_families(std::vector<RayFamily>& out, const GridFrame& frame, RandomRays& random, std::size_t count) {
  out.push_back(family("from inside", count, [&] { return random.placed(random.point(), random.direction()); }));
  out.push_back(family("window of t", count, [&] {
    Ray ray = random.through(random.point(), random.direction());
    const double middle = random.uniform(0, 2 * random.reach()), half = random.uniform(0, 0.3) * random.reach();
    ray.t_min = float(middle - half);
    ray.t_max = float(middle + half);
    return ray;
  }));
  out.push_back(family("window of no length", count, [&] {
    Ray ray = random.through(random.point(), random.direction());
    ray.t_min = ray.t_max = float(random.uniform(0, 2 * random.reach()));
    return ray;
  }));
  out.push_back(family("behind the origin", count, [&] {
    Ray ray = random.placed(random.point(), random.direction());
    ray.t_min = float(-2 * random.reach());
    return ray;
  }));
  out.push_back(family("away from the domain", count, [&] {
    const glm::dvec3 d = random.direction();
    return random.placed(random.point() + random.reach() * d, d);
  }));
  out.push_back(family("long and short directions", count, [&] {
    return random.through(random.point(), random.direction() * std::pow(10.0, random.uniform(-10, 10)));
  }));
  out.push_back(family("far origins", count, [&] {
    const glm::dvec3 p = random.point(), d = random.direction();
    return random.placed(p - d * random.reach() * std::pow(10.0, random.uniform(0, 4)), d);
  }));
  (void)frame;
}

// Rays that meet the surface in the worst way.
void add_surface_families(std::vector<RayFamily>& out, const GridFrame& frame, std::span<const SurfaceSample> samples,
                          RandomRays& random, std::size_t count) {
  // One cell, in world units.
  const double cell = std::cbrt(std::abs(glm::determinant(frame.placement.axes)));
  const double reach = random.reach() * cell;
  const auto pick = [&] { return samples[std::size_t(random.integer(0, int(samples.size()) - 1))]; };

  out.push_back(family("tangent", count, [&] {
    const SurfaceSample s = pick();
    const glm::dvec3 d = any_tangent(s.normal, random);
    return Ray{glm::vec3(s.point - reach * d), glm::vec3(d)};
  }));
  out.push_back(family("two roots closer than a sixteenth of a cell", count, [&] {
    // Inside by the sagitta of a chord of up to a sixteenth of a cell on a surface whose radius is 1 to 100 cells.
    const SurfaceSample s = pick();
    const glm::dvec3 d = any_tangent(s.normal, random);
    const double chord = random.uniform(0, 1.0 / 16) * cell, radius = std::pow(10.0, random.uniform(0, 2)) * cell;
    return Ray{glm::vec3(s.point - s.normal * (chord * chord / (8 * radius)) - reach * d), glm::vec3(d)};
  }));
  out.push_back(family("from the surface", count, [&] {
    return Ray{glm::vec3(pick().point), glm::vec3(random.direction())};
  }));
  out.push_back(family("from the surface, tangent", count, [&] {
    const SurfaceSample s = pick();
    return Ray{glm::vec3(s.point), glm::vec3(any_tangent(s.normal, random))};
  }));
  out.push_back(family("to the surface", count, [&] {
    const SurfaceSample s = pick();
    const glm::dvec3 d = random.direction() * cell;
    return Ray{glm::vec3(s.point - d), glm::vec3(d), 0.0f, 1.0f};
  }));
}

RayFamily invalid_family(RandomRays& random, std::size_t count) {
  std::size_t next = 0;
  RayFamily out = family("not finite, no direction, or empty range", count,
                         [&] { return spoiled(random.through(random.point(), random.direction()), next++); });
  out.valid = false;
  return out;
}

}  // namespace

Ray spoiled(Ray ray, std::size_t which) {
  const std::array bad{nan, infinity, -infinity};
  which %= 22;
  if (which < 9) ray.origin[int(which) / 3] = bad[which % 3];
  else if (which < 18) ray.direction[int(which - 9) / 3] = bad[which % 3];
  else if (which == 18) ray.direction = glm::vec3(0.0f);
  else if (which == 19) ray.t_min = nan;
  else if (which == 20) ray.t_max = nan;
  else ray.t_min = 1.0f, ray.t_max = 0.5f;
  return ray;
}

GridFrame frame_of(const Volume& volume) { return {volume.size(), volume.placement()}; }

RayFamily random_chords(const GridFrame& frame, std::size_t count, unsigned seed) {
  RandomRays random(frame, seed);
  RayFamily out = family("random chords", count, [&] {
    const glm::dvec3 a = random.point();
    glm::dvec3 b = random.point();
    while (glm::length(b - a) < 1e-3) b = random.point() + random.direction();
    return random.through(a, (b - a) * random.uniform(0.01, 1));
  });
  out.random = true;
  return out;
}

RayBatch chords_between(const GridFrame& frame, const glm::dvec3& low, const glm::dvec3& high, std::size_t count,
                        unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto point = [&] {
    return frame.to_world(low + (high - low) * glm::dvec3(uniform(random), uniform(random), uniform(random)));
  };
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const glm::dvec3 a = point(), b = point();
    rays.set(i, {glm::vec3(a), glm::vec3(b - a), 0.0f, 1.0f});
  }
  return rays;
}

RayFamily camera_rays(const GridFrame& frame, std::size_t count, unsigned seed) {
  constexpr int width = 64;
  RandomRays random(frame, seed);
  const glm::dvec3 center = frame.to_world(0.5 * frame.last());
  double radius = 0;
  for (int corner = 0; corner < 8; corner++)
    radius = std::max(
        radius,
        glm::length(frame.to_world(glm::dvec3(corner & 1, (corner >> 1) & 1, corner >> 2) * frame.last()) - center));
  RayFamily out{"camera", RayBatch((count + width - 1) / width * width), true};
  out.rays.image_width = width;
  glm::dvec3 eye(0.0), right(0.0), up(0.0), forward(0.0);
  for (std::size_t i = 0; i < out.rays.size(); i++) {
    if (i % (width * width) == 0) {
      forward = random.direction();
      eye = center - 2.5 * radius * forward;
      right = any_tangent(forward, random);
      up = glm::cross(right, forward);
    }
    const double x = (double(i % width) + 0.5) / width - 0.5, y = (double(i / width % width) + 0.5) / width - 0.5;
    out.rays.set(i, {glm::vec3(eye), glm::vec3(glm::normalize(forward + 0.8 * (x * right + y * up)))});
  }
  return out;
}

std::vector<RayFamily> hostile_families(const GridFrame& frame, std::span<const SurfaceSample> on_surface,
                                        std::size_t count, unsigned seed) {
  RandomRays random(frame, seed);
  std::vector<RayFamily> out;
  add_grid_families(out, frame, random, count);
  add_extent_families(out, frame, random, count);
  if (!on_surface.empty()) add_surface_families(out, frame, on_surface, random, count);
  out.push_back(invalid_family(random, count));
  return out;
}

BoxChords chords_of(const glm::dvec3& lower, const glm::dvec3& upper) {
  return {.lower = lower, .upper = upper, .before = 1.5 * glm::length(upper - lower)};
}

RayBatch random_chords(const BoxChords& chords, std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto point = [&](double part) {
    while (true) {
      const glm::dvec3 u(unit(random), unit(random), unit(random));
      const glm::dvec3 p = chords.lower + (chords.upper - chords.lower) * u;
      if (chords.radius == 0 || glm::length(p) <= chords.radius) return part * p;
    }
  };
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const double part = i % 2 == 0 ? 1 : chords.inner;
    const glm::dvec3 a = point(part), b = point(part);
    const glm::dvec3 along = glm::normalize(b - a);
    const double speed = chords.least_speed + chords.speeds * unit(random);
    rays.set(i, {glm::vec3(a - chords.before * along), glm::vec3(speed * along)});
  }
  return rays;
}

RayBatch chords_from_afar(const glm::dvec3& upper, std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  RayBatch rays(count);
  for (std::size_t i = 0; i < count; i++) {
    const glm::dvec3 a(unit(random), unit(random), unit(random)), b(unit(random), unit(random), unit(random));
    rays.set(i, {glm::vec3(upper * (a - 4.0 * (b - a))), glm::vec3(upper * (b - a))});
  }
  return rays;
}

void add_line(std::vector<Ray>& rays, const glm::vec3& origin, const glm::vec3& direction) {
  if (direction != glm::vec3(0.0f)) rays.push_back({origin, direction, -whole_line, whole_line});
}

RayBatch sphere_chords(const glm::vec3& lower, const glm::vec3& upper, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  const glm::vec3 centre = 0.5f * (lower + upper);
  const float radius = 0.5f * glm::length(upper - lower);
  const auto on_sphere = [&] {
    return centre + radius * glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
  };
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < count; i++) {
    const glm::vec3 from = on_sphere();
    add_line(rays, from, on_sphere() - from);
  }
  return RayBatch(rays);
}

RayBatch hostile_lines(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces, float size,
                       std::size_t most) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  const auto any = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
  const auto vertex = [&](std::size_t i) {
    return vertices[i * std::max<std::size_t>(1, vertices.size() / most) % vertices.size()];
  };
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < std::min(most, vertices.size()); i++) {
    const glm::vec3 p = vertex(i);
    add_line(rays, p, any());              // through a vertex, from it
    add_line(rays, p, vertex(i + 1) - p);  // from one to another, through it where the difference is exact
    for (int axis = 0; axis < 3; axis++) {
      glm::vec3 direction(0.0f), start = p;
      direction[axis] = i % 2 == 0 ? 1.0f : -1.0f;
      start[axis] -= 2 * size * direction[axis];
      add_line(rays, start, direction);
    }
  }
  for (std::size_t i = 0; i < std::min(most, faces.size()); i++) {
    const glm::uvec3 f = faces[i * std::max<std::size_t>(1, faces.size() / most) % faces.size()];
    const glm::vec3 a = vertices[f.x], b = vertices[f.y], c = vertices[f.z];
    add_line(rays, a, b - a);                                               // along an edge
    add_line(rays, a, (b - a) + (c - a));                                   // in the plane
    add_line(rays, a - (b - a), 2.0f * (b - a) - (c - a));                  // in the plane, past the triangle
    add_line(rays, 0.5f * (a + b), any());                                  // through the middle of an edge
    add_line(rays, a, glm::cross(glm::cross(b - a, c - a) / size, any()));  // grazing
  }
  return RayBatch(rays);
}

RayBatch raster_lines(const glm::vec3& lower, const glm::vec3& upper, int axis) {
  constexpr int across = 32;
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const glm::vec3 extent = upper - lower;
  std::vector<Ray> rays;
  for (int j = 0; j < across; j++) {
    for (int i = 0; i < across; i++) {
      glm::vec3 origin = lower, direction(0.0f);
      origin[x] += extent[x] * float(i) / 16.0f - extent[x] / 2;
      origin[y] += extent[y] * float(j) / 16.0f - extent[y] / 2;
      origin[axis] -= extent[axis];
      direction[axis] = 1.0f;
      add_line(rays, origin, direction);
    }
  }
  RayBatch batch(rays);
  batch.image_width = across;
  return batch;
}

}  // namespace smurf::test
