// Gauss and mean curvature of implicit surfaces against closed forms, on every device, at the hits of random rays.
//
// The forms are those of differential geometry, in the signs of the library: n = ∇f/|∇f|, positive where the surface
// bends away from it.
// The Barth sextic has none; its derivatives are taken by the rules of products in double (truth/sturm.hpp), without
// the library's derivatives of expressions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "expression/parser.hpp"
#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/points.hpp"
#include "harness/tolerances.hpp"
#include "smurf/interrogator.hpp"
#include "truth/rays.hpp"
#include "truth/sturm.hpp"

KERNELS(find_hits, count_blocks, order_rows, measure);

namespace smurf::test {
namespace {

constexpr std::string_view kind = "implicit";
// The promise of the library is relative; but where one curvature or the sum of both vanishes (the parabolic circles of
// a torus), relative to this part of the greater one, or its square: of two numbers known to 1e-6 each nobody knows the
// sum any better.
constexpr double cancelled = 0.02;
// Hits nearer to a node are left out: there curvature grows without bounds, and a location that is a float is not on
// the surface.
constexpr double near_node = 0.03;

struct Curvature {
  double gauss, mean;
};
using CurvatureAt = std::function<Curvature(const glm::dvec3&)>;

void expect_curvatures(const std::string& name, const std::string& equation, const Domain& domain,
                       const CurvatureAt& exact) {
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  const AlgebraicSurface algebraic(graph, expression::parse(graph, equation, variables, {}));
  const Surface surface = implicit(equation, domain);
  for (const TestDevice& device : one_of_each()) {
    const RayBatch rays = chords_from_afar(domain.upper, device.slow ? 500 : 4000, 29);
    const HitList hits = Interrogator(device.device, surface)
                             .cast(rays, {.hits = Hits::all, .properties = Property::gauss | Property::mean});
    const double allowed =
        tolerance(Quantity::curvature, kind, device.name == "reference" ? Precision::float64 : Precision::float32)
            .value;
    std::size_t left_out = 0;
    const PointErrors errors =
        compare_points(hits.properties(Property::gauss | Property::mean), hits.locations(), hits.size(),
                       [&](std::size_t, const glm::dvec3& p) -> std::optional<PointTruth> {
                         if (algebraic.distance_of_singularity(p) < near_node) {
                           left_out++;
                           return {};
                         }
                         const Curvature truth = exact(p);
                         // k1 and k2 from their sum and product.
                         const double apart = std::sqrt(std::max(truth.mean * truth.mean - truth.gauss, 0.0));
                         const double size = std::abs(truth.mean) + apart;
                         return PointTruth{.exact = {.gauss = truth.gauss, .mean = truth.mean},
                                           .mean = allowed * std::max(std::abs(truth.mean), cancelled * size),
                                           .gauss = allowed * std::max(std::abs(truth.gauss), cancelled * size * size)};
                       });
    const std::string where = name + ", " + device.label;
    std::cout << "  " << where << ": " << errors.compared << " hits, " << left_out
              << " near singular points, error / tolerance:" << errors.summary() << "\n";
    expect_points(errors, hits.locations(), where);
    EXPECT_GT(errors.compared, rays.size() / 8) << where;
    EXPECT_LE(left_out, errors.compared / 5) << where;
  }
}

Domain box(double half) { return {glm::dvec3(-half), glm::dvec3(half), 0}; }

TEST(ImplicitClosedForms, Sphere) {
  expect_curvatures("sphere", "x^2+y^2+z^2-2.25", box(2), [](const glm::dvec3& p) {
    const double r = glm::length(p);
    return Curvature{1 / (r * r), 1 / r};
  });
}

TEST(ImplicitClosedForms, Torus) {
  // Radii 1.5 and 0.5: (|p|² + R² - r²)² = 4R²(x² + y²)
  expect_curvatures("torus", "(x^2+y^2+z^2+2)^2-9*(x^2+y^2)", box(2), [](const glm::dvec3& p) {
    const double ring = std::hypot(p.x, p.y), tube = std::hypot(ring - 1.5, p.z);
    const double across = 1 / tube, around = (ring - 1.5) / tube / ring;
    return Curvature{across * around, 0.5 * (across + around)};
  });
}

TEST(ImplicitClosedForms, Ellipsoid) {
  // Half axes 2, 1, 1.25
  expect_curvatures("ellipsoid", "x^2/4+y^2+z^2/1.5625-1", box(2), [](const glm::dvec3& p) {
    const glm::dvec3 squares(4, 1, 1.5625);
    const double product = squares.x * squares.y * squares.z;
    const glm::dvec3 slope = p / squares;
    const double steep = glm::dot(slope, slope);
    return Curvature{1 / (product * steep * steep),
                     (squares.x + squares.y + squares.z - glm::dot(p, p)) / (2 * product * steep * std::sqrt(steep))};
  });
}

TEST(ImplicitClosedForms, MonkeySaddle) {
  // The graph z = h = x³ - 3xy² and f = h - z, whose normals look down: bending away from them is what bends up.
  expect_curvatures("monkey saddle", "x^3-3*x*y^2-z", box(1.5), [](const glm::dvec3& p) {
    const double hx = 3 * p.x * p.x - 3 * p.y * p.y, hy = -6 * p.x * p.y;
    const double hxx = 6 * p.x, hxy = -6 * p.y, hyy = -6 * p.x, w = 1 + hx * hx + hy * hy;
    return Curvature{(hxx * hyy - hxy * hxy) / (w * w),
                     ((1 + hx * hx) * hyy - 2 * hx * hy * hxy + (1 + hy * hy) * hxx) / (2 * w * std::sqrt(w))};
  });
}

TEST(ImplicitClosedForms, BarthSextic) {
  const std::string equation =
      "4*(2.618033988749895*x^2-y^2)*(2.618033988749895*y^2-z^2)*(2.618033988749895*z^2-x^2)"
      "-4.23606797749979*(x^2+y^2+z^2-1)^2";
  const Domain domain{glm::dvec3(-2), glm::dvec3(2), 2};
  expression::Graph graph;
  const std::vector<std::string> variables{"x", "y", "z"};
  const AlgebraicSurface sextic(graph, expression::parse(graph, equation, variables, {}));
  expect_curvatures("Barth sextic", equation, domain, [&](const glm::dvec3& p) {
    const Jet jet = sextic.jet(p);
    // Of -f, whose normals are -∇(-f).
    const Differential d = differential_of({-jet.value, -jet.gradient, -jet.hessian});
    return Curvature{d.gauss, d.mean};
  });
}

}  // namespace
}  // namespace smurf::test
