#include "truth/nurbs.hpp"

#include <cmath>
#include <numbers>

namespace smurf::test {
namespace {

using glm::dvec4;

// A curve in the plane of x and z, homogeneous.
struct Profile {
  int degree = 0;
  std::vector<double> knots{};
  std::vector<dvec4> points{};
};

// Control point i of `arcs` quarters of the unit circle that begin at an angle.
dvec4 circle_point(double begin, int i) {
  const double weight = i % 2 == 0 ? 1 : std::numbers::sqrt2 / 2, angle = begin + i * std::numbers::pi / 4;
  // Odd points lie at √2 with the weight 1/√2.
  return {std::cos(angle), 0, std::sin(angle), weight};
}

std::vector<double> circle_knots(int arcs) {
  std::vector<double> knots{0, 0, 0};
  for (int i = 1; i < arcs; i++) knots.insert(knots.end(), 2, i);
  knots.insert(knots.end(), 3, arcs);
  return knots;
}

Patch revolved(const Profile& profile) {
  Patch patch;
  patch.degree = {2, profile.degree};
  patch.size = {9, int(profile.points.size())};
  patch.knots = {circle_knots(4), profile.knots};
  for (const dvec4& p : profile.points) {
    for (int i = 0; i < 9; i++) {
      const dvec4 c = circle_point(0, i);
      patch.points.emplace_back(p.x * c.x, p.x * c.z, p.z * c.w, p.w * c.w);
    }
  }
  return patch;
}

}  // namespace

Patch nurbs_torus(double ring_radius, double tube_radius) {
  Profile profile{2, circle_knots(4), {}};
  for (int i = 0; i < 9; i++) {
    const dvec4 c = circle_point(0, i);
    profile.points.emplace_back(ring_radius * c.w + tube_radius * c.x, 0, tube_radius * c.z, c.w);
  }
  return revolved(profile);
}

Patch nurbs_sphere(double radius) {
  Profile profile{2, circle_knots(2), {}};
  for (int i = 0; i < 5; i++) {
    const dvec4 c = circle_point(-std::numbers::pi / 2, i);
    profile.points.emplace_back(i % 4 == 0 ? 0 : radius * c.x, 0, radius * c.z, c.w);
  }
  return revolved(profile);
}

Patch nurbs_cylinder(double radius, double height) {
  return revolved({1, {0, 0, 1, 1}, {dvec4(radius, 0, 0, 1), dvec4(radius, 0, height, 1)}});
}

Patch bilinear_patch(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
  return bezier_patch(1, 1, {dvec4(a, 1), dvec4(b, 1), dvec4(c, 1), dvec4(d, 1)});
}

}  // namespace smurf::test
