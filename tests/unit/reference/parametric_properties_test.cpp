// The reference for parametric surfaces and patches: normals, curvature and nearest points against closed forms; limits
// at poles.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "reference/surface.hpp"
#include "smurf/surface.hpp"
#include "surfaces/kinds.hpp"
#include "truth/nurbs.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr double pi = std::numbers::pi;
constexpr double closely = 1e-9;

class Measured {
 public:
  explicit Measured(const Surface& surface) : reference_(refer(surface.model())) {}
  SurfaceFrame at(float u, float v, std::uint32_t part = 0) const {
    const SurfaceCoordinates coordinates{part, u, v};
    return reference_->measure(dvec3(0), &coordinates).frame;
  }
  ReferencePoint nearest(const dvec3& point) const { return reference_->measure(point); }

 private:
  std::shared_ptr<const ReferenceSurface> reference_;
};

double gauss(const SurfaceFrame& f) { return f.k1 * f.k2; }
double mean(const SurfaceFrame& f) { return 0.5 * (f.k1 + f.k2); }

void expect_near(const dvec3& a, const dvec3& b, double tolerance) {
  EXPECT_LE(glm::distance(a, b), tolerance)
      << a.x << " " << a.y << " " << a.z << " is not " << b.x << " " << b.y << " " << b.z;
}

// Places spread over [0, 1]².
template <class Test>
void for_places(const Test& test) {
  for (int j = 0; j < 12; j++) {
    for (int i = 0; i < 12; i++) test((i + 0.3) / 12, (j + 0.4) / 12);
  }
}

TEST(ParametricProperties, OfATorus) {
  const Measured torus(parametric({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {0, 2 * pi}, {0, 2 * pi}));
  for_places([&](double x, double y) {
    const auto u = float(2 * pi * x), v = float(2 * pi * y);
    const SurfaceFrame f = torus.at(u, v);
    const double c = std::cos(double(v)), s = std::sin(double(v)), ring = 2 + c;
    expect_near(f.normal, {c * std::cos(double(u)), c * std::sin(double(u)), s}, closely);
    EXPECT_NEAR(gauss(f), c / ring, closely);
    EXPECT_NEAR(mean(f), 0.5 * (1 + c / ring), closely);
    EXPECT_NEAR(f.k1, 1, closely);
    EXPECT_EQ(f.status, PointStatus::regular);
    EXPECT_NEAR(std::abs(glm::dot(f.d2, dvec3(-std::sin(double(u)), std::cos(double(u)), 0))), 1, closely);
  });
}

TEST(ParametricProperties, OfAPatchAreThoseOfItsSurface) {
  const Measured torus(nurbs({test::nurbs_torus(2, 1)}));
  const Measured sphere(nurbs({test::nurbs_sphere(2)}));
  for_places([&](double x, double y) {
    const SurfaceFrame f = torus.at(float(4 * x), float(4 * y));
    const double c = std::hypot(f.normal.x, f.normal.y);
    EXPECT_NEAR(f.k1, 1, closely);
    EXPECT_NEAR(std::abs(f.k2), c / (f.k2 > 0 ? 2 + c : 2 - c), closely);
    const SurfaceFrame g = sphere.at(float(4 * x), float(2 * y));
    EXPECT_NEAR(g.k1, 0.5, closely);
    EXPECT_NEAR(g.k2, 0.5, closely);
    EXPECT_EQ(g.status, PointStatus::umbilic);
  });
}

TEST(ParametricProperties, EnneperIsMinimalAndThePseudosphereOfCurvatureMinusOne) {
  const Measured enneper(parametric({"u-u^3/3+u*v^2", "-v+v^3/3-v*u^2", "u^2-v^2"}, {-1.5, 1.5}, {-1.5, 1.5}));
  const Measured pseudosphere(parametric({"cos(u)/cosh(v)", "sin(u)/cosh(v)", "v-tanh(v)"}, {0, 2 * pi}, {0.2, 3}));
  for_places([&](double x, double y) {
    const auto u = float(3 * x - 1.5), v = float(3 * y - 1.5);
    const double size = 1 + double(u) * u + double(v) * v;
    EXPECT_NEAR(mean(enneper.at(u, v)), 0, closely);
    EXPECT_NEAR(gauss(enneper.at(u, v)), -4 / std::pow(size, 4), closely);
    EXPECT_NEAR(gauss(pseudosphere.at(float(2 * pi * x), float(0.2 + 2.8 * y))), -1, closely);
  });
}

TEST(ParametricProperties, HaveLimitsAtSmoothPoles) {
  const Measured sphere(parametric({"cos(v)*cos(u)", "cos(v)*sin(u)", "sin(v)"}, {0, 2 * pi}, {-pi / 2, pi / 2}));
  const Measured patch(nurbs({test::nurbs_sphere(1)}));
  const auto expect_pole = [&](const SurfaceFrame& f, double z) {
    expect_near(f.normal, {0, 0, z}, closely);
    EXPECT_NEAR(f.k1, 1, 1e-8);
    EXPECT_NEAR(f.k2, 1, 1e-8);
    EXPECT_EQ(f.status, PointStatus::singular | PointStatus::umbilic);
  };
  for (const float u : {0.0f, 1.0f, 4.0f}) {
    expect_pole(sphere.at(u, float(-pi / 2)), -1);
    expect_pole(sphere.at(u, float(pi / 2)), 1);
    expect_pole(patch.at(u, 0), -1);
    expect_pole(patch.at(u, 2), 1);
  }
  EXPECT_EQ(sphere.at(1, 1.57f).status, PointStatus::umbilic);
  // A spheroid: k = c/a² at its poles; and a paraboloid of two curvatures.
  const Measured flat(parametric({"2*cos(v)*cos(u)", "2*cos(v)*sin(u)", "sin(v)"}, {0, 2 * pi}, {-pi / 2, pi / 2}));
  EXPECT_NEAR(flat.at(0, float(pi / 2)).k1, 0.25, 1e-8);
  const Measured bowl(parametric({"v*cos(u)", "v*sin(u)", "-v^2*(cos(u)^2+2*sin(u)^2)"}, {0, 2 * pi}, {0, 1}));
  const SurfaceFrame f = bowl.at(1, 0);
  EXPECT_EQ(f.status, PointStatus::singular);
  expect_near(f.normal, {0, 0, -1}, closely);
  EXPECT_NEAR(f.k1, -2, 1e-8);
  EXPECT_NEAR(f.k2, -4, 1e-8);
}

TEST(ParametricProperties, HaveNoLimitAtATip) {
  const Measured cone(parametric({"v*cos(u)", "v*sin(u)", "v"}, {0, 2 * pi}, {0, 1}));
  const SurfaceFrame f = cone.at(2, 0);
  EXPECT_EQ(f.status, PointStatus::singular | PointStatus::undefined);
  EXPECT_TRUE(std::isnan(f.normal.x));
  EXPECT_TRUE(std::isnan(f.k1));
  EXPECT_EQ(cone.at(2, 0.01f).status, PointStatus::regular);
}

TEST(ParametricProperties, NearestPoints) {
  const Measured torus(parametric({"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"}, {0, 2 * pi}, {0, 2 * pi}));
  const Measured patch(nurbs({test::nurbs_torus(2, 1)}));
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> number(-4, 4);
  for (int i = 0; i < 300; i++) {
    const dvec3 p(number(random), number(random), 0.5 * number(random));
    const double ring = std::hypot(p.x, p.y);
    const dvec3 from_tube = p - 2.0 / ring * dvec3(p.x, p.y, 0), normal = glm::normalize(from_tube);
    for (const Measured* measured : {&torus, &patch}) expect_near(measured->nearest(p).frame.normal, normal, 1e-6);
    double u = std::atan2(p.y, p.x), v = std::atan2(from_tube.z, ring - 2);
    if (u < 0) u += 2 * pi;
    if (v < 0) v += 2 * pi;
    EXPECT_NEAR(torus.nearest(p).coordinates.u, u, 1e-5);
    EXPECT_NEAR(torus.nearest(p).coordinates.v, v, 1e-5);
  }
  // Beyond the border of a patch.
  const Measured square(nurbs({test::bilinear_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0})}));
  const SurfaceCoordinates corner = square.nearest({3, 2, 5}).coordinates,
                           side = square.nearest({0.3, -2, 1}).coordinates;
  EXPECT_EQ(corner.u, 1);
  EXPECT_EQ(corner.v, 1);
  EXPECT_FLOAT_EQ(side.u, 0.3f);
  EXPECT_EQ(side.v, 0);
  EXPECT_NE(square.nearest({std::nan(""), 0, 0}).frame.status & PointStatus::undefined, 0u);
}

}  // namespace
}  // namespace smurf
