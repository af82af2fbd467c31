// The reference of expressions: ranges of rays, domains, points, updates. Nothing here needs a device.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "reference/queries.hpp"
#include "unit/reference/implicit_reference.hpp"

namespace smurf::reference_test {
namespace {

double greatest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// --- ranges and domains -------------------------------------------------------------------------

TEST(ImplicitReference, RangesAndRaysFromInside) {
  for (const std::string text : {"x^2 + y^2 + z^2 - 1", "sqrt(x^2 + y^2 + z^2) - 1"}) {
    const FunctionRoots roots = roots_for(text);
    const auto range = [&](double from, double to, double start = 0) {
      return hits_of(roots, {dvec3(start, 0, 0), x_axis, from, to});
    };
    expect_roots(range(0, infinity), {1}, 1e-12);         // from the centre
    expect_roots(range(0, infinity, 0.9), {0.1}, 1e-12);  // from inside
    expect_roots(range(-10, 10), {-1, 1}, 1e-12);         // backwards, too
    expect_roots(range(-10, 0), {-1}, 1e-12);
    expect_roots(range(0, 1.0001), {1}, 1e-12);
    EXPECT_TRUE(range(0, 0.9999).empty());
    EXPECT_TRUE(range(1.0001, infinity).empty());
    EXPECT_TRUE(range(0, infinity, 3).empty());  // behind it
    EXPECT_TRUE(range(0, infinity, 1.5).empty());
    EXPECT_TRUE(range(0.5, 0.5).empty());
    expect_roots(range(0.99999999, 1.00000001), {1}, 1e-12);
    // Beginning or ending on it.
    for (const auto& hits : {range(1, infinity), range(0, 1), range(0, infinity, 1), range(1, 1)}) {
      ASSERT_EQ(hits.size(), 1u);
      EXPECT_EQ(hits[0].status, HitStatus::unresolved);
    }
  }
}

TEST(ImplicitReference, FarOriginsAndLengthsOfDirections) {
  for (const std::string text : {"x^2 + y^2 + z^2 - 0.49", "sqrt(x^2 + y^2 + z^2) - 0.7"}) {
    for (const double scale : {1e-30, 1e-6, 1e6, 1e30}) {
      const auto hits = hits_of(text, {dvec3(-3, 0.1, 0.2), scale * x_axis});
      ASSERT_EQ(hits.size(), 2u);
      EXPECT_NEAR(hits[0].t * scale, 3 - std::sqrt(0.44), 1e-12);
      EXPECT_NEAR(hits[1].t * scale, 3 + std::sqrt(0.44), 1e-12);
    }
    for (const double far : {1e4, 1e8, 1e12}) {
      const auto hits = hits_of(text, {dvec3(-far, 0.1, 0.2), x_axis});
      ASSERT_EQ(hits.size(), 2u);
      for (const int h : {0, 1}) {
        EXPECT_EQ(hits[h].status, HitStatus::isolated);
        EXPECT_NEAR(hits[h].t - far, (2 * h - 1) * std::sqrt(0.44), 1e-15 * far);
        EXPECT_LT(hits[h].uncertainty, 1e-15 * far + 1e-12);
      }
    }
  }
  // Small and large worlds.
  for (const double size : {1e-12, 1e-3, 1e3, 1e12}) {
    const auto hits =
        hits_of("x^2 + y^2 + z^2", {dvec3(-3, 0.1, 0.2) * size, x_axis}, box(2 * size), 0.49 * size * size);
    ASSERT_EQ(hits.size(), 2u);
    EXPECT_NEAR(hits[0].t / size, 3 - std::sqrt(0.44), 1e-12);
  }
}

TEST(ImplicitReference, TheBox) {
  const Domain domain{dvec3(-1, -2, 0), dvec3(3, 1, 0.5), 0};
  expect_roots(hits_of("sin(pi*x)", {dvec3(-5.25, 0, 0.25), x_axis}, {dvec3(-0.5, -2, 0), dvec3(2.5, 1, 0.5), 0}),
               {5.25, 6.25, 7.25}, 1e-12);
  EXPECT_TRUE(hits_of("x", {dvec3(-5, 1.001, 0.25), x_axis}, domain).empty());  // beside it
  EXPECT_TRUE(hits_of("x", {dvec3(-5, 0, -0.001), x_axis}, domain).empty());
  expect_roots(hits_of("x", {dvec3(-5, 1, 0.5), x_axis}, domain), {5}, 1e-12);  // in an edge
  expect_roots(hits_of("x", {dvec3(-5, 0, 0), dvec3(1, 1e-18, 0)}, domain), {5}, 1e-12);
  EXPECT_TRUE(hits_of("x-3.001", {dvec3(-5, 0, 0.25), x_axis}, domain).empty());
  // No thickness.
  const Domain sheet{dvec3(-1, -1, 0), dvec3(1, 1, 0), 0};
  expect_roots(hits_of("x^2+z-0.25", {dvec3(-2, 0.1, 0), x_axis}, sheet), {1.5, 2.5}, 1e-12);
  EXPECT_TRUE(hits_of("x^2+z-0.25", {dvec3(0, 0, -1), dvec3(0, 0, 1)}, sheet).empty());
  EXPECT_EQ(hits_of("x^2+z-0.25", {dvec3(0.5, 0, -1), dvec3(0, 0, 1)}, sheet).size(), 1u);
}

TEST(ImplicitReference, TheBall) {
  Domain domain = box(1);
  domain.radius = 1.25;  // cuts off the corners
  Uniform uniform(11);
  int in = 0, cut_off = 0;
  for (const std::string text : {"x + 2*y - 3*z - 0.25", "sinh(x + 2*y - 3*z - 0.25)"}) {
    const FunctionRoots roots = roots_for(text, domain);
    for (int i = 0; i < 500; i++) {
      const ReferenceRay ray = random_ray(uniform, 1);
      const dvec3 normal(1, 2, -3);
      const double t = (0.25 - glm::dot(normal, ray.origin)) / glm::dot(normal, ray.direction);
      const dvec3 at = ray.origin + t * ray.direction;
      const double beyond = std::max(glm::length(at) - 1.25, greatest(at) - 1);
      if (std::abs(beyond) < 1e-4) continue;
      const auto hits = hits_of(roots, ray);
      ASSERT_EQ(hits.size(), beyond < 0 ? 1u : 0u) << i;
      for (const ReferenceHit& hit : hits) EXPECT_NEAR(hit.t, t, 1e-10);
      in += beyond < 0;
      cut_off += beyond > 0 && greatest(at) < 1;
    }
  }
  EXPECT_GT(in, 100);
  EXPECT_GT(cut_off, 5);
  EXPECT_TRUE(hits_of("x", {dvec3(-3, 0.95, 0.95), x_axis}, domain).empty());  // misses the ball
  expect_roots(hits_of("x", {dvec3(-1e8, 0.1, 0.95), x_axis}, domain), {1e8}, 1e-6);
  expect_roots(hits_of("x", {dvec3(0, 0, 0), x_axis, -1, 5}, domain), {0}, 1e-12);
}

// --- points -------------------------------------------------------------------------------------

TEST(ImplicitReference, PointsOutsideOrUndefined) {
  Domain domain = box(1);
  domain.radius = 1.25;
  const auto defined = [&](const std::string& text, const dvec3& point, bool value, bool frame) {
    const ReferencePoint p = measured(*surface_of(text, Side::out_of_smaller, domain), point);
    EXPECT_EQ(std::isfinite(p.value), value) << text;
    EXPECT_EQ(p.frame.status != PointStatus::undefined, frame) << text;
    EXPECT_EQ(std::isfinite(p.frame.k1), frame) << text;
  };
  const std::string sphere = "x^2+y^2+z^2-0.5";
  defined(sphere, {0.5, 0.2, 0.1}, true, true);
  defined(sphere, {1, 0, 0}, true, true);
  defined(sphere, {1 + 1e-10, 0, 0}, true, true);
  defined(sphere, {double(float(1)) + 1e-7, 0, 0}, true, true);  // as floats round
  defined(sphere, {1.00001, 0, 0}, false, false);
  defined(sphere, {0.9, 0.9, 0}, false, false);  // outside of the ball
  defined(sphere, {0, 0, 0}, true, false);       // no gradient
  defined("sqrt(x)", {-0.5, 0, 0}, false, false);
  defined("sqrt(x)", {0, 0, 0}, true, false);
  defined("x*abs(x)^1.5 + y", {0, 0.5, 0}, true, false);  // value and gradient, but no second derivatives
  defined("1/x", {0, 0, 0}, false, false);
  defined("exp(1000*x)", {1, 0, 0}, false, false);
  defined(sphere, {std::numeric_limits<double>::quiet_NaN(), 0, 0}, false, false);
}

TEST(ImplicitReference, PlanesAreUmbilic) {
  for (const std::string text :
       {"x + 0.3*y - 0.7*z", "exp(x + 0.3*y - 0.7*z) - 1", "(x + 0.3*y - 0.7*z)*(x^2+y^2+1)"}) {
    const SurfaceFrame frame = measured(*surface_of(text), {0.4, 1, 1}).frame;
    EXPECT_EQ(frame.status, PointStatus::umbilic) << text;
    EXPECT_NEAR(frame.k1, 0, 1e-12);
  }
}

TEST(ImplicitReference, UpdatesShareTheFunction) {
  const auto surface = surface_of("x^2 + y^2 + z^2", Side::out_of_smaller, box(2), 1);
  const auto queries = interrogate_by_reference(*surface);
  const auto& reference = dynamic_cast<const ReferenceQueries&>(*queries);
  EXPECT_GT(queries->device_bytes(), 0u);
  const auto roots = [&] {
    std::vector<ReferenceHit> hits;
    reference.surface().roots({dvec3(-3, 0, 0), x_axis}, false, hits);
    return hits;
  };
  expect_roots(roots(), {2, 4}, 1e-12);

  const ImplicitSurface moved("implicit", surface->text, surface->function, 2.25, Side::out_of_greater, box(2));
  const auto next = reference.surface().updated(moved);
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->measure({1.5, 0, 0}).frame.k1, -1 / 1.5, 1e-12);
  EXPECT_NEAR(reference.surface().measure({1.5, 0, 0}).frame.k1, 1 / 1.5, 1e-12);
  queries->update(std::make_shared<const ImplicitSurface>("implicit", surface->text, surface->function, 2.25,
                                                          surface->side, box(2)));
  expect_roots(roots(), {1.5, 4.5}, 1e-12);

  const auto other = surface_of("x^2 + y^2 + z^2", Side::out_of_smaller, box(2), 0.25);
  EXPECT_FALSE(reference.surface().updated(*other));
  queries->update(other);
  expect_roots(roots(), {2.5, 3.5}, 1e-12);
}

}  // namespace
}  // namespace smurf::reference_test
