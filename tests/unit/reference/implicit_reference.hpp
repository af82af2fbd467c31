// What the tests of the reference of expressions share: surfaces from texts, rays, and hits compared with roots known
// otherwise.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "expression/parser.hpp"
#include "reference/implicit/roots.hpp"
#include "reference/surface.hpp"
#include "surfaces/implicit/definition.hpp"
#include "surfaces/kinds.hpp"
#include "unit/reference/reference_volumes.hpp"

namespace smurf::reference_test {

using glm::dvec3;
using Side = ImplicitSurface::Side;

inline constexpr double pi = std::numbers::pi;
inline const dvec3 x_axis(1, 0, 0);

inline std::shared_ptr<const ImplicitFunction> function_of(const std::string& text) {
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  const expression::NodeId value = expression::parse(graph, text, variables, {});
  return differentiated(std::move(graph), value);
}

inline Domain box(double half) { return {dvec3(-half), dvec3(half), 0}; }

inline FunctionRoots roots_for(const std::string& text, const Domain& domain = box(2), double level = 0) {
  return FunctionRoots(function_of(text), domain, level);
}

inline std::vector<ReferenceHit> hits_of(const FunctionRoots& roots, const ReferenceRay& ray) {
  std::vector<ReferenceHit> hits, first;
  roots.find(ray, false, hits);
  roots.find(ray, true, first);
  EXPECT_EQ(first.empty(), hits.empty());
  if (!first.empty() && !hits.empty()) {
    EXPECT_EQ(first[0].t, hits[0].t);
    EXPECT_EQ(first[0].status, hits[0].status);
  }
  for (std::size_t i = 1; i < hits.size(); i++) EXPECT_LT(hits[i - 1].t, hits[i].t);
  return hits;
}

inline std::vector<ReferenceHit> hits_of(const std::string& text, const ReferenceRay& ray,
                                         const Domain& domain = box(2), double level = 0) {
  return hits_of(roots_for(text, domain, level), ray);
}

// The hits are isolated, at these t, and enclose them.
inline void expect_roots(const std::vector<ReferenceHit>& hits, const std::vector<double>& t, double tolerance,
                         const std::string& where = "") {
  ASSERT_EQ(hits.size(), t.size()) << where;
  for (std::size_t i = 0; i < t.size(); i++) {
    EXPECT_EQ(hits[i].status, HitStatus::isolated) << where << ", root " << i;
    EXPECT_NEAR(hits[i].t, t[i], tolerance) << where;
    EXPECT_LE(hits[i].uncertainty, tolerance) << where;
    EXPECT_LE(std::abs(hits[i].t - t[i]), hits[i].uncertainty + 1e-15) << where << ", root " << i;
  }
}

// Through a random point of the box, from outside.
inline ReferenceRay random_ray(Uniform& uniform, double half) {
  const dvec3 direction = uniform(0.2, 5) * uniform.direction();
  return {uniform.vector(-half, half) - 20 * half * glm::normalize(direction), direction};
}

inline std::shared_ptr<const ImplicitSurface> surface_of(const std::string& text, Side side = Side::out_of_smaller,
                                                         const Domain& domain = box(2), double level = 0) {
  return std::make_shared<const ImplicitSurface>("implicit", text, function_of(text), level, side, domain);
}

inline ReferencePoint measured(const ImplicitSurface& surface, const dvec3& point) {
  return refer(surface)->measure(point);
}

// Of a sphere, and in `distance` how far the ray's nearest point is from it.
inline std::vector<double> sphere_roots(const ReferenceRay& ray, const dvec3& centre, double radius, double* distance) {
  const dvec3 o = ray.origin - centre;
  const double speed2 = glm::dot(ray.direction, ray.direction), near = -glm::dot(o, ray.direction) / speed2;
  const dvec3 foot = o + near * ray.direction;
  *distance = std::abs(glm::length(foot) - radius);
  const double h2 = (radius * radius - glm::dot(foot, foot)) / speed2;
  if (h2 < 0) return {};
  return {near - std::sqrt(h2), near + std::sqrt(h2)};
}

}  // namespace smurf::reference_test
