#include "truth/flow/flows.hpp"

#include <fmt/format.h>

#include <cmath>

#include "truth/jet2.hpp"

namespace smurf::test {
namespace {

using glm::dvec3;

Domain cube(double half) { return {dvec3(-half), dvec3(half)}; }

const std::vector<dvec3>& common_seeds() {
  static const std::vector<dvec3> seeds{{0.3, 0.2, -0.1}, {-0.4, 0.5, 0.25}, {0.1, -0.6, 0.4}, {-0.2, -0.3, -0.5}};
  return seeds;
}

// Of u, where Jet2 knows u and v.
Jet2 of_u(double value, double first, double second) {
  Jet2 jet(value, first, 0);
  jet.uu = second;
  return jet;
}

using Jets = std::array<Jet2, 3>;

// A flow written once, for jets.
template <class Flow>
FlowTruth closed_form(std::string name, std::array<std::string, 3> vector, const Domain& domain, double time,
                      std::function<dvec3(const dvec3&)> value, Flow flow) {
  FlowTruth truth{std::move(name), std::move(vector), domain, std::move(value), {}, time, common_seeds()};
  truth.at = [flow](const dvec3& seed, const dvec3& tangent, const dvec3& second, double t) {
    const Jets end = flow(
        Jets{of_u(seed.x, tangent.x, second.x), of_u(seed.y, tangent.y, second.y), of_u(seed.z, tangent.z, second.z)},
        t);
    return FlowPosition{
        {end[0].value, end[1].value, end[2].value}, {end[0].u, end[1].u, end[2].u}, {end[0].uu, end[1].uu, end[2].uu}};
  };
  return truth;
}

}  // namespace

glm::dmat4 exponential(const glm::dmat4& a) {
  double norm = 0;
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 4; r++) norm = std::max(norm, std::abs(a[c][r]));
  int halvings = 0;
  while (std::ldexp(norm, -halvings) > 1.0 / 16) halvings++;
  const glm::dmat4 small = a * std::ldexp(1.0, -halvings);
  // Terms beyond the 16th are below (1/4)^17 / 17! of the first.
  glm::dmat4 sum(1.0), term(1.0);
  for (int k = 1; k <= 16; k++) {
    term = term * small / double(k);
    sum += term;
  }
  for (int k = 0; k < halvings; k++) sum = sum * sum;
  return sum;
}

FlowTruth linear_flow(const std::string& name, const glm::dmat3& a, const dvec3& b) {
  FlowTruth truth{name, {}, cube(4), {}, {}, 1, common_seeds()};
  for (int r = 0; r < 3; r++)
    truth.vector[std::size_t(r)] = fmt::format("({})*x + ({})*y + ({})*z + ({})", a[0][r], a[1][r], a[2][r], b[r]);
  truth.value = [a, b](const dvec3& p) { return a * p + b; };
  truth.at = [a, b](const dvec3& seed, const dvec3& tangent, const dvec3& second, double t) {
    glm::dmat4 whole(0.0);
    for (int c = 0; c < 3; c++) whole[c] = glm::dvec4(a[c], 0);
    whole[3] = glm::dvec4(b, 0);
    const glm::dmat4 e = exponential(whole * t);
    const glm::dmat3 linear(e);
    return FlowPosition{dvec3(e * glm::dvec4(seed, 1)), linear * tangent, linear * second};
  };
  return truth;
}

std::vector<FlowTruth> linear_flows() {
  // glm's matrices are given by columns.
  std::vector<FlowTruth> flows{
      linear_flow("rotation", {0, 1, 0, -1, 0, 0, 0, 0, 0}, dvec3(0)),
      linear_flow("shear", {0, 0, 0, 1, 0, 0, 0, 0, 0}, {0.25, 0, 0}),
      linear_flow("saddle", {1, 0, 0, 0, -1, 0, 0, 0, 0}, {0, 0, 0.1}),
      linear_flow("helix", {0, 1, 0, -1, 0, 0, 0, 0, 0}, {0, 0, 0.3}),
      linear_flow("general linear", {0.3, -0.7, 0.2, 0.9, -0.4, 0.1, -0.2, 0.5, 0.15}, {0.2, -0.1, 0.3}),
  };
  flows[0].time = flows[3].time = 6;
  return flows;
}

std::vector<FlowTruth> nonlinear_flows() {
  std::vector<FlowTruth> flows;
  // y' and z' are integrals of polynomials in t.
  flows.push_back(closed_form(
      "polynomial", {"0.5", "x^2", "x*y"}, cube(4), 1.5,
      [](const dvec3& p) { return dvec3(0.5, p.x * p.x, p.x * p.y); },
      [](const Jets& c, double t) {
        const double a = 0.5;
        const Jet2 &x = c[0], &y = c[1], &z = c[2];
        // y(s) = y + x² s + a x s² + a² s³/3; z' = (x + a s) y(s).
        const Jet2 y_end = y + x * x * t + a * t * t * x + a * a * t * t * t / 3;
        const Jet2 z_end = z + x * y * t + t * t / 2 * (x * x * x + a * y) + t * t * t / 3 * (2 * a) * (x * x) +
                           t * t * t * t / 4 * (a * a * 4.0 / 3) * x + a * a * a * t * t * t * t * t / 15;
        return Jets{x + a * t, y_end, z_end};
      }));
  // Turns that are faster farther out.
  flows.push_back(closed_form(
      "swirl", {"-y*(1 + x^2 + y^2)", "x*(1 + x^2 + y^2)", "0.2*x"}, cube(4), 2,
      [](const dvec3& p) {
        const double w = 1 + p.x * p.x + p.y * p.y;
        return dvec3(-p.y * w, p.x * w, 0.2 * p.x);
      },
      [](const Jets& c, double t) {
        const Jet2 &x = c[0], &y = c[1];
        const Jet2 w = 1.0 + x * x + y * y, cosine = cos(t * w), sine = sin(t * w);
        return Jets{x * cosine - y * sine, x * sine + y * cosine, c[2] + 0.2 * (x * sine - y * (1.0 - cosine)) / w};
      }));
  // Riccati's equation for x; x y stays as it is.
  flows.push_back(closed_form(
      "riccati", {"-x^2", "x*y", "y"}, cube(4), 0.8, [](const dvec3& p) { return dvec3(-p.x * p.x, p.x * p.y, p.y); },
      [](const Jets& c, double t) {
        const Jet2 &x = c[0], &y = c[1], w = 1.0 + t * x;
        return Jets{x / w, y * w, c[2] + t * y + t * t / 2 * (x * y)};
      }));
  return flows;
}

std::vector<FlowTruth> known_flows() {
  std::vector<FlowTruth> flows = linear_flows();
  for (FlowTruth& flow : nonlinear_flows()) flows.push_back(std::move(flow));
  return flows;
}

FlowInvariant hill_vortex() {
  // Stokes' stream function -3/4 r² (1 - r² - z²), r the distance from the axis.
  return {"Hill's vortex",
          {"-1.5*x*z", "-1.5*y*z", "-1.5*(1 - 2*(x^2 + y^2) - z^2)"},
          cube(1.5),
          6,
          {{0.5, 0.1, 0.1}, {0.2, 0.3, -0.4}, {-0.6, 0.2, 0.3}},
          [](const dvec3& p) {
            const double r2 = p.x * p.x + p.y * p.y;
            return -0.75 * r2 * (1 - r2 - p.z * p.z);
          }};
}

FlowInvariant cylinder_stream() {
  return {"cylinder",
          {"1 - (x^2 - y^2)/(x^2 + y^2)^2", "-2*x*y/(x^2 + y^2)^2", "0.05"},
          {dvec3(-6, -6, -1), dvec3(6, 6, 1)},
          8,
          {{-4, 0.3, -0.5}, {-4, -0.8, -0.5}, {-4, 1.5, -0.5}},
          [](const dvec3& p) { return p.y * (1 - 1 / (p.x * p.x + p.y * p.y)); }};
}

std::vector<FlowInvariant> invariant_flows() { return {hill_vortex(), cylinder_stream()}; }

dvec3 AbcFlow::value(const dvec3& p) {
  const double a = std::sqrt(3.0), b = std::sqrt(2.0);
  return {a * std::sin(p.z) + std::cos(p.y), b * std::sin(p.x) + a * std::cos(p.z), std::sin(p.y) + b * std::cos(p.x)};
}

dvec3 extrapolated_line(const std::function<dvec3(const dvec3&)>& value, const dvec3& seed, double time, int steps) {
  constexpr std::size_t stages = 8;
  const double length = time / steps;
  dvec3 x = seed;
  for (int step = 0; step < steps; step++) {
    std::array<dvec3, stages> row{}, above{};
    for (std::size_t k = 0; k < stages; k++) {
      const int parts = 2 * (int(k) + 1);
      const double h = length / parts;
      dvec3 before = x, now = x + h * value(x);
      for (int i = 1; i < parts; i++) {
        const dvec3 next = before + 2 * h * value(now);
        before = now;
        now = next;
      }
      row[0] = 0.5 * (before + now + h * value(now));
      for (std::size_t j = 1; j <= k; j++) {
        const double ratio = double(k + 1) / double(k + 1 - j);
        row[j] = row[j - 1] + (row[j - 1] - above[j - 1]) / (ratio * ratio - 1);
      }
      above = row;
    }
    x = row[stages - 1];
  }
  return x;
}

}  // namespace smurf::test
