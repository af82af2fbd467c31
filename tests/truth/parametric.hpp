// Surfaces s(u, v) of which answers are known: position and derivatives everywhere, and for algebraic ones the roots on
// a ray with their u and v.
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "patches/bezier.hpp"
#include "smurf/rays.hpp"
#include "smurf/surface.hpp"
#include "truth/jet.hpp"
#include "truth/jet2.hpp"

namespace smurf::test {

// By the fundamental forms; the normal is along x_u × x_v. Nothing where x_u and x_v span no plane.
std::optional<Differential> differential_of(const PatchPoint& point);

// From a function of jets, which gives x, y and z.
template <class Position>
std::function<PatchPoint(double, double)> points_of(Position position) {
  return [position](double u, double v) {
    const std::array<Jet2, 3> p = position(Jet2(u, 1, 0), Jet2(v, 0, 1));
    PatchPoint at;
    for (int c = 0; c < 3; c++) {
      const Jet2& j = p[std::size_t(c)];
      at.position[c] = j.value;
      at.u[c] = j.u, at.v[c] = j.v;
      at.uu[c] = j.uu, at.uv[c] = j.uv, at.vv[c] = j.vv;
    }
    return at;
  };
}

struct ParametricScene {
  std::string name;
  std::array<std::string, 3> position{};
  glm::dvec2 lower{0.0}, upper{1.0};  // of u and v
  std::function<PatchPoint(double u, double v)> at{};
  // Of u and of v: the surface goes on at the other end of the range; and does so with the other coordinate mirrored.
  std::array<bool, 2> closed{};
  bool mirrored = false;
  std::vector<glm::dvec2> poles{};  // a place of each
  // Of algebraic surfaces: a polynomial in x, y and z that vanishes on it, and where a point of it lies.
  std::string equation{};
  std::function<glm::dvec2(const glm::dvec3&)> place{};

  Surface surface() const { return parametric(position, {lower.x, upper.x}, {lower.y, upper.y}, {}, closed); }
  std::string description() const;  // JSON
};

// With closed forms.
ParametricScene sphere_scene(double radius);
ParametricScene ellipsoid_scene();
ParametricScene torus_scene(double great, double small);
ParametricScene cylinder_scene(double radius, double height);
std::vector<ParametricScene> algebraic_scenes();

// Of which roots are known by the reference alone.
ParametricScene helicoid_scene();
ParametricScene enneper_scene();
ParametricScene klein_scene();
ParametricScene boy_scene();
ParametricScene pseudosphere_scene();
std::vector<ParametricScene> other_scenes();

// The greatest side of the box around samples, and the box.
Bounds sampled_bounds(const ParametricScene& scene);
double extent_of(const Bounds& bounds);

struct ParametricRoot {
  double t;
  glm::dvec2 place;
  bool certain;  // not within rounding of the ray's ends or of the border of the surface
};
struct ParametricRoots {
  std::vector<ParametricRoot> at;  // ascending in t
  bool doubtful = false;           // their number is not known
};

// The exact roots on rays of a scene that has an equation.
class AlgebraicRoots {
 public:
  explicit AlgebraicRoots(const ParametricScene& scene);
  ParametricRoots on(const Ray& ray) const;

 private:
  struct State;
  std::shared_ptr<const State> state_;
};

// How far apart two places of the surface are on it, about: differences of u and v, by way of the seams where that is
// shorter, times the size of x_u and x_v. A pole, and a seam, are the same from wherever they are named.
double distance_on(const ParametricScene& scene, const glm::dvec2& a, const glm::dvec2& b);

}  // namespace smurf::test
