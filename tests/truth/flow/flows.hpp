// Flows of which answers are known: closed forms of the position and of its first and second derivative by a parameter
// of the seed, quantities that stay the same along lines, and an integrator of high order that shares nothing with the
// library's.
#pragma once

#include <array>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "smurf/flow.hpp"

namespace smurf::test {

struct FlowPosition {
  glm::dvec3 position, first, second;  // by u
};

struct FlowTruth {
  std::string name;
  std::array<std::string, 3> vector;  // expressions
  Domain domain;
  std::function<glm::dvec3(const glm::dvec3&)> value;
  // Where a seed c(u) with derivatives c' and c'' is after a time.
  std::function<FlowPosition(const glm::dvec3& seed, const glm::dvec3& tangent, const glm::dvec3& second, double time)>
      at;
  double time = 1;                // a time for which seeds near the origin stay in the domain, in both directions
  std::vector<glm::dvec3> seeds;  // such seeds

  VectorField field() const { return expression_flow(vector, domain); }
};

// v = A x + b, by the exponential of the matrix.
FlowTruth linear_flow(const std::string& name, const glm::dmat3& a, const glm::dvec3& b);
std::vector<FlowTruth> linear_flows();     // rotation, shear, saddle, helix, a general one
std::vector<FlowTruth> nonlinear_flows();  // with second derivatives of their own
std::vector<FlowTruth> known_flows();      // both

// e^A, by scaling and squaring of the series. Its last row and column may be those of a flow with b.
glm::dmat4 exponential(const glm::dmat4& a);

// Quantities that do not change along lines.
struct FlowInvariant {
  std::string name;
  std::array<std::string, 3> vector;
  Domain domain;
  double time;
  std::vector<glm::dvec3> seeds;
  std::function<double(const glm::dvec3&)> constant;

  VectorField field() const { return expression_flow(vector, domain); }
};
FlowInvariant hill_vortex();      // inside of the unit sphere
FlowInvariant cylinder_stream();  // potential flow past the unit cylinder, with w = 0.05
std::vector<FlowInvariant> invariant_flows();

// Arnold, Beltrami and Childress: A = sqrt(3), B = sqrt(2), C = 1.
struct AbcFlow {
  std::array<std::string, 3> vector{"sqrt(3)*sin(z) + cos(y)", "sqrt(2)*sin(x) + sqrt(3)*cos(z)",
                                    "sin(y) + sqrt(2)*cos(x)"};
  Domain domain{glm::dvec3(-20), glm::dvec3(20)};
  static glm::dvec3 value(const glm::dvec3& p);
};

// Gragg's method, extrapolated to order 16 (Bulirsch and Stoer 1966; Hairer, Nørsett, Wanner 1993, II.9), with steps of
// one length.
glm::dvec3 extrapolated_line(const std::function<glm::dvec3(const glm::dvec3&)>& value, const glm::dvec3& seed,
                             double time, int steps);

}  // namespace smurf::test
