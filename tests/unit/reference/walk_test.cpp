// Walking by the reference: where section curves of every kind of surface lead, against closed forms; where they end.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "reference/surface.hpp"
#include "smurf/black_box.hpp"
#include "smurf/flow.hpp"
#include "smurf/smurf.hpp"
#include "smurf/stream.hpp"
#include "surfaces/kinds.hpp"
#include "truth/meshes.hpp"

namespace smurf::test {
namespace {

using glm::dvec3;

constexpr double pi = std::numbers::pi;
using Reference = std::shared_ptr<const ReferenceSurface>;

Reference reference_of(const Surface& surface) { return refer(surface.model()); }
Domain cube(double half) { return {dvec3(-half), dvec3(half)}; }

ReferenceWalker step(const Reference& surface, const dvec3& p, const dvec3& d, double r) {
  const ReferenceWalker from = surface->begin_walk(p, nullptr, d, 1e-3);
  EXPECT_EQ(from.status, WalkStatus::start) << name_of(from.status);
  if (from.status != WalkStatus::start) return from;
  return surface->neighbor(from, r);
}

void expect_at(const ReferenceWalker& end, const dvec3& location, double allowed,
               WalkStatus status = WalkStatus::reached) {
  EXPECT_EQ(end.status, status) << name_of(end.status);
  EXPECT_LE(glm::distance(end.location, location), allowed)
      << end.location.x << " " << end.location.y << " " << end.location.z << " instead of " << location.x << " "
      << location.y << " " << location.z;
}

// ---- The unit sphere as every kind that has one

struct Sphere {
  std::string name;
  Reference surface;
  double allowed;  // of what is reached
};

Surface sampled_sphere() {
  const SampledField field = sample_field(implicit("x^2+y^2+z^2-1", cube(1.5)), glm::ivec3(31), 5);
  return isosurface(field.volume, field.isovalue, {.reconstruction = Reconstruction::tricubic});
}

std::vector<Sphere> spheres() {
  BlackBox ball;
  ball.source = "FN real black_box(real x, real y, real z) { return x * x + y * y + z * z - 1.0f; }";
  ball.value = [](const dvec3& p) { return glm::dot(p, p) - 1; };
  return {
      {"implicit", reference_of(implicit("x^2+y^2+z^2-1", cube(1.5))), 1e-11},
      {"black box", reference_of(implicit(ball, cube(1.5))), 1e-11},
      {"tricubic grid", reference_of(sampled_sphere()), 1e-5},
      {"parametric",
       reference_of(parametric({"cos(v)*cos(u)", "cos(v)*sin(u)", "sin(v)"}, {0, 2 * pi}, {-pi / 2, pi / 2})), 1e-11},
  };
}

TEST(ReferenceWalk, StepsOnSpheresFollowGreatCircles) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  for (const Sphere& sphere : spheres()) {
    SCOPED_TRACE(sphere.name);
    for (int i = 0; i < 20; i++) {
      const dvec3 n = glm::normalize(vector());
      const dvec3 any = vector(), d = glm::normalize(any - n * glm::dot(any, n));
      for (const double r : {0.01, 0.3, 1.0, 1.95}) {
        const double angle = 2 * std::asin(r / 2);
        const ReferenceWalker end = step(sphere.surface, n, any, r);
        const double allowed = sphere.allowed / std::cos(angle / 2);
        expect_at(end, std::cos(angle) * n + std::sin(angle) * d, allowed);
        EXPECT_NEAR(end.chord, r, 1e-12);
        EXPECT_LE(glm::distance(end.normal, end.location * glm::sign(glm::dot(end.normal, end.location))),
                  1e3 * allowed);
        EXPECT_LE(glm::distance(end.direction, std::cos(angle) * d - std::sin(angle) * n), 1e3 * allowed);
      }
      const ReferenceWalker beyond = step(sphere.surface, n, any, 2.01);
      expect_at(beyond, n, 10 * sphere.allowed, WalkStatus::unreachable);
      EXPECT_EQ(beyond.chord, 0);
    }
  }
}

// Along meridians, through the pole.
TEST(ReferenceWalk, PolesOfParametricSpheresAreOnTheWay) {
  const Reference sphere = spheres().back().surface;
  for (const double u : {0.0, 0.3, 2.0, 5.0}) {
    const dvec3 out(std::cos(u), std::sin(u), 0), p = std::cos(1.2) * out + dvec3(0, 0, std::sin(1.2));
    const dvec3 d = dvec3(0, 0, std::cos(1.2)) - std::sin(1.2) * out;
    const ReferenceWalker end = step(sphere, p, d, 2 * std::sin(0.5));
    expect_at(end, std::cos(2.2) * out + dvec3(0, 0, std::sin(2.2)), 1e-9);
    const ReferenceWalker from_pole = step(sphere, dvec3(0, 0, 1), out, 2 * std::sin(0.5));
    expect_at(from_pole, std::sin(1.0) * out + dvec3(0, 0, std::cos(1.0)), 1e-9);
  }
}

TEST(ReferenceWalk, PathsOnATorusCloseAlongItsCircles) {
  const std::vector<Reference> tori{
      reference_of(implicit("(sqrt(x^2+y^2)-2)^2+z^2-0.25", cube(3))),
      reference_of(
          parametric({"(2+0.5*cos(v))*cos(u)", "(2+0.5*cos(v))*sin(u)", "0.5*sin(v)"}, {0, 2 * pi}, {0, 2 * pi})),
      reference_of(load_nurbs(SMURF_SOURCE_DIR "/host/examples/nurbs-torus.json"))};
  const std::vector<dvec3> radii{{2, 0.5, 0}, {2, 0.5, 0}, {2, 1, 0}};
  for (std::size_t kind = 0; kind < tori.size(); kind++) {
    SCOPED_TRACE(kind);
    const double great = radii[kind].x, small = radii[kind].y;
    // The outer equator in 40 steps, then a small circle in 12.
    for (const bool around : {true, false}) {
      const int steps = around ? 40 : 12;
      const double radius = around ? great + small : small, r = 2 * radius * std::sin(pi / steps);
      const dvec3 p(great + small, 0, 0), d = around ? dvec3(0, 1, 0) : dvec3(0, 0, 1);
      const dvec3 centre = around ? dvec3(0) : dvec3(great, 0, 0);
      ReferenceWalker walker = tori[kind]->begin_walk(p, nullptr, d, 1e-3);
      ASSERT_EQ(walker.status, WalkStatus::start);
      for (int i = 1; i <= steps; i++) {
        walker = tori[kind]->neighbor(walker, r);
        const double angle = 2 * pi * i / steps;
        expect_at(walker, centre + radius * (std::cos(angle) * dvec3(1, 0, 0) + std::sin(angle) * d), 1e-8);
      }
      EXPECT_LE(glm::distance(walker.direction, d), 1e-7);
    }
  }
}

// Cylinders: circles across, lines along, ellipses otherwise.
TEST(ReferenceWalk, SectionsOfCylinders) {
  const std::vector<Reference> cylinders{reference_of(implicit("x^2+y^2-1", cube(2))),
                                         reference_of(parametric({"cos(u)", "sin(u)", "v"}, {0, 2 * pi}, {-2, 2}))};
  for (const Reference& cylinder : cylinders) {
    SCOPED_TRACE(&cylinder - cylinders.data());
    const dvec3 p(1, 0, 0);
    expect_at(step(cylinder, p, dvec3(0, 0, 1), 1.5), dvec3(1, 0, 1.5), 1e-12);
    expect_at(step(cylinder, p, dvec3(0, -1, 0), std::sqrt(2.0)), dvec3(0, -1, 0), 1e-11);
    // (cos a, sin a, sin a): 2 - 2 cos a + sin² a = r² at a right angle.
    expect_at(step(cylinder, p, dvec3(0, 1, 1), std::sqrt(3.0)), dvec3(0, 1, 1), 1e-11);
    // Leaves the domain at z = 2.
    const ReferenceWalker end = step(cylinder, p, dvec3(0, 0, 1), 2.5);
    expect_at(end, dvec3(1, 0, 2), 1e-6, WalkStatus::boundary);
    EXPECT_NEAR(end.chord, 2, 1e-6);
    // Once around is never farther than across.
    expect_at(step(cylinder, p, dvec3(0, 1, 0), 2.1), p, 1e-9, WalkStatus::unreachable);
  }
}

TEST(ReferenceWalk, PlanesAndSaddles) {
  const Reference plane = reference_of(implicit("x+2*y-z", cube(4)));
  const dvec3 d = glm::normalize(dvec3(2, -1, 0));
  expect_at(step(plane, dvec3(0), d, 2.5), 2.5 * d, 1e-12);

  // z = k x y²: from (1, 1, k) with plane of the normal (-k, -2k, 1) and a direction along x.
  const double k = 0.4;
  const std::vector<Reference> graphs{reference_of(implicit("z-0.4*x*y^2", cube(4))),
                                      reference_of(parametric({"u", "v", "0.4*u*v^2"}, {-4, 4}, {-3, 3}))};
  const dvec3 p(1, 1, k), n = glm::normalize(dvec3(-k, -2 * k, 1));
  std::vector<dvec3> reached;
  for (const Reference& graph : graphs) {
    const ReferenceWalker end = step(graph, p, dvec3(1, -0.3, 0), 1.2);
    EXPECT_EQ(end.status, WalkStatus::reached);
    EXPECT_NEAR(end.location.z, k * end.location.x * end.location.y * end.location.y, 1e-12);
    EXPECT_NEAR(glm::distance(end.location, p), 1.2, 1e-12);
    const dvec3 any(1, -0.3, 0), along = glm::normalize(any - n * glm::dot(any, n));
    EXPECT_NEAR(glm::dot(end.location - p, glm::cross(n, along)), 0, 1e-7);  // p has been a float
    EXPECT_GT(glm::dot(end.location - p, along), 0);
    reached.push_back(end.location);
  }
  EXPECT_LE(glm::distance(reached[0], reached[1]), 1e-7);
}

// Never a jump to the other sheet, which is nearer than the chord.
TEST(ReferenceWalk, StaysOnItsSheet) {
  const Reference plates = reference_of(implicit("z^2-0.0001", cube(2)));
  expect_at(step(plates, dvec3(0, 0, 0.01), dvec3(1, 0, 0), 1), dvec3(1, 0, 0.01), 1e-11);
  // A thin ellipsoid: over the rim, and below back to the other side.
  const Reference disc = reference_of(implicit("x^2+y^2+z^2/0.0001-1", cube(2)));
  const ReferenceWalker end = step(disc, dvec3(0, 0, 0.01), dvec3(1, 0, 0), 0.5);
  expect_at(end, dvec3(0.5, 0, 0.01 * std::sqrt(0.75)), 1e-4);
  expect_at(step(disc, dvec3(0, 0, 0.01), dvec3(1, 0, 0), 1.01), dvec3(0, 0, 0.01), 1e-9, WalkStatus::unreachable);
}

TEST(ReferenceWalk, CreasesAreSaidAndPassed) {
  // The unit cube as an expression, and as a mesh.
  const std::vector<Reference> cubes{reference_of(implicit("max(max(abs(x),abs(y)),abs(z))-1", cube(2))),
                                     reference_of(mesh_surface(box_mesh(glm::vec3(-1), glm::vec3(1), 3)))};
  for (const Reference& box : cubes) {
    expect_at(step(box, dvec3(0.1, 0.2, 1), dvec3(1, 0, 0), 0.5), dvec3(0.6, 0.2, 1), 1e-7);
    // Over the edge at x = 1, down by the rest.
    const double down = std::sqrt(1.2 * 1.2 - 0.9 * 0.9);
    expect_at(step(box, dvec3(0.1, 0.2, 1), dvec3(1, 0, 0), 1.2), dvec3(1, 0.2, 1 - down), 1e-6, WalkStatus::crease);
    expect_at(step(box, dvec3(0.1, 0.2, 1), dvec3(1, 0, 0), 4), dvec3(0.1, 0.2, 1), 1e-6, WalkStatus::unreachable);
  }
  // The roof of a wedge of 20°: no crease.
  const Reference roof = reference_of(implicit("z+0.1763269807084650*abs(x)", cube(2)));
  EXPECT_EQ(step(roof, dvec3(-0.5, 0, -0.0881634903542325), dvec3(1, 0, 0), 1).status, WalkStatus::reached);
}

TEST(ReferenceWalk, MeshesAreFollowedFromTriangleToTriangle) {
  const Reference sphere = reference_of(mesh_surface(sphere_mesh(1, 5), MeshNormals::interpolated));
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 50; i++) {
    const dvec3 n = glm::normalize(dvec3(normal(random), normal(random), normal(random)));
    const dvec3 any(normal(random), normal(random), normal(random));
    const ReferenceWalker from = sphere->begin_walk(n, nullptr, any, 1e-2);
    ASSERT_EQ(from.status, WalkStatus::start);
    const ReferenceWalker end = sphere->neighbor(from, 1.0);
    ASSERT_EQ(end.status, WalkStatus::reached);
    EXPECT_NEAR(glm::distance(end.location, from.location), 1, 1e-12);
    EXPECT_NEAR(glm::dot(end.location - from.location, glm::cross(from.normal, from.direction)), 0, 1e-12);
    const dvec3 circle = std::cos(pi / 3) * n + std::sin(pi / 3) * glm::normalize(any - n * glm::dot(any, n));
    EXPECT_LE(glm::distance(end.location, circle), 2e-2);
    EXPECT_EQ(sphere->neighbor(from, 2.1).status, WalkStatus::unreachable);
  }
  // From a corner, and along edges.
  const Reference box = reference_of(mesh_surface(box_mesh(glm::vec3(-1), glm::vec3(1), 2)));
  expect_at(step(box, dvec3(0, 0, 1), dvec3(0, 1, 0), 0.75), dvec3(0, 0.75, 1), 1e-12);
  expect_at(step(box, dvec3(0, 0, 1), dvec3(1, 1, 0), 0.75), dvec3(0.75 / std::sqrt(2.0), 0.75 / std::sqrt(2.0), 1),
            1e-12);
  // An open cylinder ends.
  const Reference open = reference_of(mesh_surface(cylinder_mesh(1, 2, 32, 8)));
  const ReferenceWalker end = step(open, dvec3(1, 0, 1.3), dvec3(0, 0, 1), 1);
  expect_at(end, dvec3(1, 0, 2), 1e-6, WalkStatus::boundary);
}

TEST(ReferenceWalk, StreamSurfaces) {
  // A helicoid: (u cos t, u sin t, 0.3 t), whose rulings are straight.
  const VectorField field = expression_flow({"-y", "x", "0.3"}, cube(3));
  const Reference helicoid =
      reference_of(stream_surface(field, seed_expression({"u", "0", "0"}, {0.2, 1.2}), {.time = {0, 6}}));
  const double t = 1.0;
  const dvec3 out(std::cos(t), std::sin(t), 0), p = 0.5 * out + dvec3(0, 0, 0.3 * t);
  const ReferenceWalker end = step(helicoid, p, out, 0.4);
  expect_at(end, p + 0.4 * out, 1e-7);
  EXPECT_NEAR(end.u, 0.9, 1e-7);
  EXPECT_NEAR(end.v, t, 1e-7);
  const ReferenceWalker rim = step(helicoid, p, out, 0.8);
  expect_at(rim, p + 0.7 * out, 1e-6, WalkStatus::boundary);
  // A ring of rotation closes in time: the cylinder of radius 1.
  const Reference ring = reference_of(stream_surface(expression_flow({"-y", "x", "0"}, cube(3)),
                                                     seed_expression({"1", "0", "u"}, {-1, 1}), {.time = {0, 2 * pi}}));
  expect_at(step(ring, dvec3(0, -1, 0.2), dvec3(1, 0, 0), 2 * std::sin(pi / 3)),
            dvec3(std::cos(pi / 6), std::sin(pi / 6), 0.2), 1e-6);
}

TEST(ReferenceWalk, StartsAreCheckedAndMoved) {
  const Reference sphere = spheres().front().surface;
  const auto begin = [&](const dvec3& p, const dvec3& d, double tolerance) {
    return sphere->begin_walk(p, nullptr, d, tolerance);
  };
  EXPECT_EQ(begin(dvec3(1.1, 0, 0), dvec3(0, 1, 0), 0.01).status, WalkStatus::off_surface);
  EXPECT_EQ(begin(dvec3(1, 0, 0), dvec3(-3, 0, 0), 0.01).status, WalkStatus::no_direction);
  EXPECT_EQ(begin(dvec3(1, 0, 0), dvec3(0), 0.01).status, WalkStatus::no_direction);
  const ReferenceWalker moved = begin(dvec3(1.05, 0, 0), dvec3(5, 2, 0), 0.1);
  EXPECT_EQ(moved.status, WalkStatus::start);
  EXPECT_LE(glm::distance(moved.location, dvec3(1, 0, 0)), 1e-12);
  EXPECT_LE(glm::distance(moved.direction, dvec3(0, 1, 0)), 1e-12);
}

}  // namespace
}  // namespace smurf::test
