// Stream surfaces of which all is known: the map x(u, τ) with its derivatives in closed form, and every root on a ray
// with its u and τ, by polynomials (Sturm) or by a function of one variable whose monotone pieces are known.
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "patches/bezier.hpp"
#include "smurf/rays.hpp"
#include "smurf/stream.hpp"
#include "truth/parametric.hpp"

namespace smurf::test {

// Where a line meets a surface that is longer than ours by a little at each end. A place that the surface passes twice
// is there twice.
struct StreamPlaces {
  struct At {
    double t;
    glm::dvec2 place;  // u, τ
  };
  std::vector<At> at;
  bool doubtful = false;
};

struct StreamScene {
  std::string name;
  std::array<std::string, 3> vector{};
  Domain domain{};
  std::array<std::string, 3> seed{};    // expressions in u, or
  std::vector<glm::dvec3> points = {};  // a polyline
  glm::dvec2 range{0.0, 1.0}, time{0.0, 1.0};
  std::function<PatchPoint(double u, double time)> at{};
  std::array<bool, 2> closed{};
  std::function<StreamPlaces(const Ray&)> places{};
  // The time at which the line from c(u) leaves the domain; none does where it is empty. Only for times from 0 on.
  std::function<double(double u)> leaves = {};

  VectorField field() const { return expression_flow(vector, domain); }
  SeedLine seeds() const { return points.empty() ? seed_expression(seed, range) : seed_points(points); }
  Surface surface(StreamOptions options = {}) const;
  std::string description(StreamMethod method) const;  // JSON
  // u and τ as u and v, for what asks surfaces s(u, v).
  ParametricScene parametric() const;
};

// v = (-y, x, c) from a radius: K = -c²/(c²+u²)², H = 0.
StreamScene helicoid_stream(const glm::dvec2& time = {0.0, 6.0});
// Its field by vectors at nodes, over its domain. It is affine, so that grids reproduce it to the rounding of floats.
VectorField helicoid_on_grid(const glm::ivec3& size, VectorReconstruction reconstruction,
                             const glm::dvec2& time = {0.0, 6.0});
// v = (1, 0, k y²) from the y axis: z = k x y².
StreamScene graph_stream();
// The same from a polyline with a corner in it: two parts of it, tilted.
StreamScene corner_stream();
// The same in a domain that its lines leave at different times.
StreamScene cut_stream();
// A circle about the z axis: one turn, and more than one, of which the second goes over the first.
StreamScene torus_stream(double turns);
// v = A x, a spiral about a saddle, from a straight line; times from -1.
StreamScene spiral_stream();
// Turns that are faster farther out; lines go over the surface again.
StreamScene swirl_stream();
std::vector<StreamScene> stream_scenes();

// All roots on a ray with their u and τ. Those within `near` of the borders, in parts of the extent, are uncertain.
ParametricRoots roots_on(const StreamScene& scene, const ParametricScene& parametric, double extent, double near,
                         const Ray& ray);

// Stream surfaces on which a quantity is the same everywhere.
struct StreamInvariant {
  std::string name;
  std::array<std::string, 3> vector;
  Domain domain;
  std::array<std::string, 3> seed;
  glm::dvec2 range, time;
  double extent;
  std::function<double(const glm::dvec3&)> excess;  // 0 on the surface
  std::function<glm::dvec3(const glm::dvec3&)> gradient;

  Surface surface(StreamOptions options = {}) const;
};
std::vector<StreamInvariant> stream_invariants();

}  // namespace smurf::test
