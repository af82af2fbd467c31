// The reference's roots along rays against brute force and closed forms. Nothing here needs a device.
#include <gtest/gtest.h>

#include <cmath>

#include "reference/grid/roots.hpp"
#include "unit/reference/reference_volumes.hpp"

namespace smurf {
namespace {

using namespace reference_test;

std::vector<ReferenceHit> roots_of(const Volume& volume, Reconstruction reconstruction, double isovalue,
                                   const ReferenceRay& ray) {
  std::vector<ReferenceHit> hits;
  RayRoots(make_field(volume, reconstruction), isovalue).find(ray, false, hits);
  return hits;
}

ReferenceRay random_ray(const GridField& field, Uniform& uniform) {
  const dvec3 last(field.size() - 1);
  const dvec3 target = field.to_world(uniform.vector(0, 1) * last);
  const dvec3 direction = uniform(0.2, 5) * uniform.direction();
  return {target - 20.0 * direction, direction};
}

// Signs of f - isovalue at many points of a ray: the parameters around each change.
std::vector<double> dense_roots(const GridField& field, double isovalue, const ReferenceRay& ray, int points) {
  double from = ray.t_min, to = 1e3;
  const dvec3 o = field.to_index(ray.origin), d = field.direction_to_index(ray.direction);
  for (int a = 0; a < 3; a++) {
    const double t0 = -o[a] / d[a], t1 = (field.size()[a] - 1 - o[a]) / d[a];
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  std::vector<double> found;
  double last_t = from, last = 0;
  for (int i = 0; i <= points; i++) {
    const double t = from + (to - from) * i / points;
    const auto value = field.value(ray.origin + t * ray.direction);
    if (!value) continue;
    if (last != 0 && (*value < isovalue) != (last < 0)) found.push_back(0.5 * (t + last_t));
    last = *value < isovalue ? -1 : 1;
    last_t = t;
  }
  return found;
}

class ReferenceRoots : public testing::TestWithParam<Reconstruction> {};
INSTANTIATE_TEST_SUITE_P(Reconstructions, ReferenceRoots, testing::ValuesIn(all_reconstructions), [](const auto& info) {
  return info.param == Reconstruction::catmull_rom ? "catmull_rom" : std::string(name_of(info.param));
});

TEST_P(ReferenceRoots, AgreeWithDenseSampling) {
  const auto field = make_field(noise_volume({12, 9, 10}, sheared, 31), GetParam());
  Uniform uniform(32);
  const int points = 100'000;
  std::size_t total = 0;
  for (int i = 0; i < 24; i++) {
    const double isovalue = uniform(-0.3, 0.3);
    const RayRoots roots(field, isovalue);
    const ReferenceRay ray = random_ray(*field, uniform);
    // Pairs of roots below this margin may be closer together than the sampling.
    const RayRoots::Margins margins = roots.margins(ray);
    if (margins.extremum < 1e-6 || margins.end < 1e-6) continue;
    std::vector<ReferenceHit> hits;
    roots.find(ray, false, hits);
    const std::vector<double> dense = dense_roots(*field, isovalue, ray, points);
    ASSERT_EQ(hits.size(), dense.size()) << "ray " << i << ", margin " << margins.extremum;
    for (std::size_t h = 0; h < hits.size(); h++) {
      EXPECT_EQ(hits[h].status, HitStatus::isolated);
      EXPECT_NEAR(hits[h].t, dense[h], 100.0 / points);
      EXPECT_NEAR(*field->value(ray.origin + hits[h].t * ray.direction), isovalue, 1e-12);
      EXPECT_GE(hits[h].margin, margins.extremum);
      EXPECT_LT(hits[h].uncertainty, 1e-8);
    }
    total += hits.size();
  }
  EXPECT_GT(total, 30u);
}

TEST_P(ReferenceRoots, CountTheChangesOfSign) {
  const auto field = make_field(noise_volume({20, 20, 20}, sheared, 41), GetParam());
  const RayRoots roots(field, 0.05);
  Uniform uniform(42);
  int flagged = 0;
  for (int i = 0; i < 3000; i++) {
    ReferenceRay ray = random_ray(*field, uniform);
    const dvec3 last(field->size() - 1);
    const dvec3 a = field->to_world(uniform.vector(0, 1) * last), b = field->to_world(uniform.vector(0, 1) * last);
    ray = {a, b - a, 0, 1};
    std::vector<ReferenceHit> hits, first;
    roots.find(ray, false, hits);
    roots.find(ray, true, first);
    double slope = 0;
    bool isolated = true;
    for (const ReferenceHit& hit : hits) {
      isolated &= hit.status == HitStatus::isolated;
      EXPECT_LE(hit.slope * slope, 0) << "slopes alternate";
      slope = hit.slope;
      EXPECT_TRUE(hit.t >= 0 && hit.t <= 1);
    }
    ASSERT_EQ(first.empty(), hits.empty());
    if (!hits.empty()) {
      EXPECT_EQ(first[0].t, hits[0].t);
    }
    flagged += !isolated;
    if (!isolated) continue;
    EXPECT_EQ(hits.size() % 2 == 1, (*field->value(a) < 0.05) != (*field->value(b) < 0.05));
  }
  EXPECT_LE(flagged, 1);
}

TEST_P(ReferenceRoots, OnCellFacesCountOnce) {
  const Volume ramp = make_volume({9, 9, 9}, {}, [](int i, int, int) { return i; });
  const Volume diagonal = make_volume({9, 9, 9}, {}, [](int i, int j, int k) { return i + j + k; });
  for (int level = 1; level < 8; level++) {
    for (const double y : {0.0, 3.0, 3.5, 8.0}) {  // along an outer edge, inner edges, inside, the last edge
      for (const int sign : {1, -1}) {
        const auto hits = roots_of(ramp, GetParam(), level, {dvec3(sign > 0 ? -2 : 10, y, 4), dvec3(sign, 0, 0)});
        ASSERT_EQ(hits.size(), 1u) << level << " " << y;
        EXPECT_NEAR(hits[0].t, sign > 0 ? level + 2 : 10 - level, 1e-12);
        EXPECT_EQ(hits[0].status, HitStatus::isolated);
        EXPECT_EQ(hits[0].slope > 0, sign > 0);
      }
    }
    const auto hits = roots_of(diagonal, GetParam(), 3 * level, {dvec3(-1), dvec3(1)});  // from corner to corner
    ASSERT_EQ(hits.size(), 1u);
    EXPECT_NEAR(hits[0].t, level + 1, 1e-12);
    EXPECT_EQ(hits[0].status, HitStatus::isolated);
    const auto across = roots_of(diagonal, GetParam(), 12, {dvec3(-1, -1, 4), dvec3(1, 1, 0)});  // across edges
    ASSERT_EQ(across.size(), 1u);
    EXPECT_NEAR(across[0].t, 5, 1e-12);
  }
}

TEST_P(ReferenceRoots, InsideTheSurfaceAreOneUnresolvedPlateau) {
  const Volume ramp = make_volume({9, 9, 9}, {}, [](int i, int, int) { return i; });
  const auto hits = roots_of(ramp, GetParam(), 3, {dvec3(3, -1, 4.2), dvec3(0, 2, 0)});
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].status, HitStatus::unresolved);
  EXPECT_NEAR(hits[0].t, 2.5, 1e-6);
  EXPECT_NEAR(hits[0].uncertainty, 2, 1e-6);
  const Volume constant = make_volume({5, 5, 5}, {}, [](int, int, int) { return 7; });
  EXPECT_EQ(roots_of(constant, GetParam(), 7, {dvec3(-1, 2.2, 2), dvec3(1, 0.1, 0)}).size(), 1u);
  EXPECT_EQ(roots_of(constant, GetParam(), 6, {dvec3(-1, 2.2, 2), dvec3(1, 0.1, 0)}).size(), 0u);
}

TEST_P(ReferenceRoots, StartingOrEndingOnTheSurfaceAreUnresolved) {
  const Volume ramp = make_volume({9, 9, 9}, {}, [](int i, int, int) { return i; });
  for (const double x : {4.0, 4.5}) {
    const double level = *make_field(ramp, GetParam())->value({x, 4, 4});
    for (const int sign : {1, -1}) {
      auto hits = roots_of(ramp, GetParam(), level, {dvec3(x, 4, 4.2), dvec3(sign, 0, 0)});
      ASSERT_EQ(hits.size(), 1u);
      EXPECT_NEAR(hits[0].t, 0, 1e-12);
      EXPECT_EQ(hits[0].status, HitStatus::unresolved);
      hits = roots_of(ramp, GetParam(), level, {dvec3(x - sign, 4, 4.2), dvec3(sign, 0, 0), 0, 1});
      ASSERT_EQ(hits.size(), 1u);
      EXPECT_NEAR(hits[0].t, 1, 1e-8);
      EXPECT_EQ(hits[0].status, HitStatus::unresolved);
    }
  }
}

TEST(ReferenceRoots, DoubleRootsAreTangent) {
  const Volume valley = make_volume({9, 9, 9}, {}, [](int i, int, int) { return std::abs(i - 4); });
  const auto kink = roots_of(valley, Reconstruction::trilinear, 0, {dvec3(-1, 2.3, 5), dvec3(1, 0, 0)});
  ASSERT_EQ(kink.size(), 1u);
  EXPECT_EQ(kink[0].status, HitStatus::tangent);
  EXPECT_NEAR(kink[0].t, 5, 1e-12);

  const auto parabola = make_field(make_volume({9, 5, 5}, {}, [](int i, int, int) { return (i - 4) * (i - 4); }),
                                   Reconstruction::catmull_rom);  // reproduces quadratics
  const ReferenceRay ray{dvec3(-1, 2.3, 3.1), dvec3(1, 0, 0)};
  for (const double shift : {1e-2, 1e-4, 1e-6, 1e-8}) {
    std::vector<ReferenceHit> two, none;
    RayRoots(parabola, shift * shift).find(ray, false, two);
    RayRoots(parabola, -shift * shift).find(ray, false, none);
    const bool flagged = shift < 3e-5;  // within 1e-9 of the scale
    ASSERT_EQ(two.size(), flagged ? 1u : 2u) << shift;
    ASSERT_EQ(none.size(), flagged ? 1u : 0u) << shift;
    EXPECT_NEAR(two[0].t, 5 - shift, flagged ? two[0].uncertainty : 1e-9);
    EXPECT_EQ(two[0].status, flagged ? HitStatus::tangent : HitStatus::isolated);
    EXPECT_GE(two[0].uncertainty, flagged ? shift : 0.0);
  }
  EXPECT_NEAR(RayRoots(parabola, 1e-4).near_tangency(ray), 1e-4 / 4, 2e-5);
}

TEST(ReferenceRoots, SurfacesOfOvershootAreFound) {
  // Samples in [0, 1], but a cubic kernel rises above 1 next to an edge.
  const Volume edge = make_volume({12, 12, 12}, {}, [](int i, int, int) { return i < 6 ? 0 : 1; });
  const ReferenceRay ray{dvec3(-1, 5.3, 5.1), dvec3(1, 0, 0)};
  EXPECT_EQ(roots_of(edge, Reconstruction::trilinear, 1.02, ray).size(), 0u);
  EXPECT_EQ(roots_of(edge, Reconstruction::catmull_rom, 1.02, ray).size(), 2u);
  EXPECT_EQ(roots_of(edge, Reconstruction::tricubic, 1.02, ray).size(), 2u);
}

TEST_P(ReferenceRoots, NonFiniteSamplesCutASurface) {
  const Volume holed = make_volume({12, 12, 12}, {}, [](int i, int j, int k) {
    if (i == 5 && j == 5 && k == 5) return double(not_a_number);
    return i == 9 && j == 9 && k == 9 ? infinity : i + 0.5;
  });
  EXPECT_EQ(roots_of(holed, GetParam(), 6.0, {dvec3(-1, 5.2, 5.3), dvec3(1, 0, 0)}).size(), 0u);
  const auto beside = roots_of(holed, GetParam(), 6.0, {dvec3(-1, 1.2, 1.3), dvec3(1, 0, 0)});
  ASSERT_EQ(beside.size(), 1u);
  EXPECT_EQ(beside[0].status, HitStatus::isolated);
  // Behind the hole, on the same ray.
  EXPECT_EQ(roots_of(holed, GetParam(), 9.25, {dvec3(-1, 5.2, 5.3), dvec3(1, 0, 0)}).size(), 1u);
  const Volume nothing = make_volume({4, 4, 4}, {}, [](int, int, int) { return not_a_number; });
  EXPECT_EQ(roots_of(nothing, GetParam(), 0, {dvec3(-1, 1, 1), dvec3(1, 0.1, 0)}).size(), 0u);
}

TEST_P(ReferenceRoots, ClipToTheDomainAndTheRange) {
  const Volume ramp = make_volume({9, 9, 9}, {}, [](int i, int, int) { return i; });
  const dvec3 x(1, 0, 0);
  EXPECT_EQ(roots_of(ramp, GetParam(), 4, {dvec3(-1, 8.001, 4), x}).size(), 0u);  // beside it
  EXPECT_EQ(roots_of(ramp, GetParam(), 4, {dvec3(9, 4, 4), x}).size(), 0u);       // behind it
  EXPECT_EQ(roots_of(ramp, GetParam(), 4, {dvec3(-1, -1, 4), dvec3(1, -1, 0)}).size(), 0u);
  EXPECT_EQ(roots_of(ramp, GetParam(), 4, {dvec3(-1, 4, 4), x, 0, 4.9}).size(), 0u);
  EXPECT_EQ(roots_of(ramp, GetParam(), 4, {dvec3(-1, 4, 4), x, 5.1, infinity}).size(), 0u);
  EXPECT_EQ(roots_of(ramp, GetParam(), 4, {dvec3(9, 4, 4), x, -20, 0}).size(), 1u);  // backwards
  EXPECT_EQ(roots_of(ramp, GetParam(), 4.5, {dvec3(-1e8, 4, 4), x}).size(), 1u);     // from afar
  EXPECT_EQ(roots_of(ramp, GetParam(), 4.5, {dvec3(-1, 4, 4), 1e-30 * x}).size(), 1u);
  EXPECT_EQ(roots_of(ramp, GetParam(), 4.5, {dvec3(-1, 4, 4), 1e30 * x}).size(), 1u);
}

TEST_P(ReferenceRoots, GridsWithoutThickness) {
  const Volume sheet = make_volume({9, 9, 1}, {}, [](int i, int, int) { return i; });
  const auto hits = roots_of(sheet, GetParam(), 4, {dvec3(-1, 4.2, 0), dvec3(1, 0.1, 0)});  // in the sheet
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_NEAR(hits[0].t, 5, 1e-12);
  EXPECT_EQ(roots_of(sheet, GetParam(), 4.5, {dvec3(3, 4, -1), dvec3(0, 0, 1)}).size(), 0u);  // through it
  EXPECT_EQ(roots_of(sheet, GetParam(), 4.5, {dvec3(-1, 4, 0.5), dvec3(1, 0, 0)}).size(), 0u);
  const Volume line = make_volume({9, 1, 1}, {}, [](int i, int, int) { return i; });
  EXPECT_EQ(roots_of(line, GetParam(), 4.5, {dvec3(-1, 0, 0), dvec3(1, 0, 0)}).size(), 1u);
  const Volume point = make_volume({1, 1, 1}, {}, [](int, int, int) { return 3; });
  EXPECT_EQ(roots_of(point, GetParam(), 2, {dvec3(-1, 0, 0), dvec3(1, 0, 0)}).size(), 0u);
  EXPECT_EQ(roots_of(point, GetParam(), 2, {dvec3(-1, 1, 0), dvec3(1, 0, 0)}).size(), 0u);
}

}  // namespace
}  // namespace smurf
