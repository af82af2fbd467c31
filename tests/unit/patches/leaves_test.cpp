// Bounds of pieces over boxes, and leaves: what they promise, at random places.
#include "patches/leaves.hpp"

#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "expression/parser.hpp"
#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "io/patch_file.hpp"
#include "unit/patches/surfaces.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;
using test::below;
using test::Uniform;

// Positions and second derivatives lie within the bounds over random boxes of all sizes, which reach up to an eighth
// beyond the range. Returns how tight the bounds of small boxes are: sampled by stated magnitudes, in the mean.
double check_bounds(const PieceSource& source, unsigned seed, double beyond) {
  Uniform uniform(seed);
  double tightness = 0;
  int small = 0;
  for (int n = 0; n < 300; n++) {
    const auto piece = std::size_t(n) % source.size();
    const ParameterBox range = source.range(piece);
    const dvec2 size = range.upper - range.lower;
    const double part = std::pow(2, -uniform(0, 8));
    const dvec2 half = 0.5 * part * size * dvec2(uniform(0.3, 1), uniform(0.3, 1));
    const dvec2 low = range.lower - beyond * size + half, high = range.upper + beyond * size - half;
    const dvec2 centre{uniform(low.x, high.x), uniform(low.y, high.y)};
    const ParameterBox box{centre - half, centre + half};
    const std::optional<PieceBounds> bounds = source.bounds(piece, box);
    if (!bounds) {
      ADD_FAILURE() << "no bounds over a box of " << half.x << " by " << half.y;
      continue;
    }
    dvec3 greatest(0);
    for (int k = 0; k < 20; k++) {
      const dvec2 place = k < 4 ? dvec2(k % 2 ? box.upper.x : box.lower.x, k / 2 ? box.upper.y : box.lower.y)
                                : dvec2(uniform(box.lower.x, box.upper.x), uniform(box.lower.y, box.upper.y));
      const PatchPoint p = source.at(piece, place.x, place.y);
      // What is sampled is itself rounded.
      const dvec3 off = 1e-12 * (glm::abs(p.position) + 1.0);
      EXPECT_TRUE(below(bounds->lower, p.position + off) && below(p.position - off, bounds->upper)) << n;
      EXPECT_TRUE(below(glm::abs(p.uu), bounds->uu + off)) << n;
      EXPECT_TRUE(below(glm::abs(p.uv), bounds->uv + off)) << n;
      EXPECT_TRUE(below(glm::abs(p.vv), bounds->vv + off)) << n;
      greatest = glm::max(greatest, glm::abs(p.uu) + glm::abs(p.uv) + glm::abs(p.vv));
    }
    if (part > 0.05) continue;
    small++;
    tightness += glm::length(greatest) / glm::length(bounds->uu + bounds->uv + bounds->vv);
  }
  return tightness / small;
}

TEST(PieceBounds, HoldOfBezierPatches) {
  Uniform uniform(1);
  for (int n = 0; n < 12; n++) {
    const bool rational = n % 2 == 1;
    EXPECT_GT(check_bounds(test::random_patch(uniform, 1 + n % 5, 1 + n % 3, rational), 100 + unsigned(n), 0.125), 0.5)
        << n;
  }
}
TEST(PieceBounds, HoldOfExpressions) {
  EXPECT_GT(check_bounds(test::torus(), 1, 0.125), 0.5);
  EXPECT_GT(check_bounds(test::sphere(), 2, 0.125), 0.5);
  EXPECT_GT(check_bounds(ExpressionSource({"u-u^3/3+u*v^2", "v-v^3/3+v*u^2", "u^2-v^2"}, {{-2, -2}, {2, 2}}), 3, 0.1),
            0.5);
}

TEST(PieceBounds, AreNoneAtCreasesJumpsAndEnds) {
  const auto bounds = [](const char* z, double low, double high) {
    return ExpressionSource({"u", "v", z}, {{-1, -1}, {1, 1}}).bounds(0, {{low, 0.1}, {high, 0.2}}).has_value();
  };
  for (const char* z : {"abs(u)", "max(u,0)", "floor(u)", "mod(u,0.5)", "sqrt(u)", "1/u", "log(u)", "sqrt(abs(u))"}) {
    EXPECT_FALSE(bounds(z, -0.1, 0.1)) << z;
    EXPECT_TRUE(bounds(z, 0.1, 0.2)) << z;
  }
}

TEST(PieceBounds, PositionsAreKnownWhereDerivativesAreNot) {
  const ExpressionSource source({"u", "v", "sqrt(u)"}, {{-1, -1}, {1, 1}});
  const auto across = source.positions(0, {{-0.01, 0}, {0.01, 1}});
  ASSERT_TRUE(across);
  EXPECT_TRUE(below(across->lower, {0.005, 0.5, std::sqrt(0.005)}));
  EXPECT_TRUE(below({0.005, 0.5, std::sqrt(0.005)}, across->upper));
  const auto nowhere = source.positions(0, {{-0.2, 0}, {-0.1, 1}});
  ASSERT_TRUE(nowhere);
  EXPECT_GT(nowhere->lower.z, nowhere->upper.z);
}

// The device's error: the position in floats, operation by operation.
TEST(PieceBounds, ErrorsOfFloatsAreCovered) {
  const ExpressionSource source = test::torus();
  Uniform uniform(4);
  double greatest = 0;
  for (int n = 0; n < 2000; n++) {
    const double u = uniform(0.01, 6.2), v = uniform(0.01, 6.2);
    const auto bounds = source.bounds(0, {{u - 0.005, v - 0.005}, {u + 0.005, v + 0.005}});
    ASSERT_TRUE(bounds);
    const float a = float(u), b = float(v), ring = 2.0f + std::cos(b);
    const dvec3 there{double(ring * std::cos(a)), double(ring * std::sin(a)), double(std::sin(b))};
    const dvec3 off = glm::abs(there - source.at(0, u, v).position);
    EXPECT_TRUE(below(off, bounds->error));
    greatest = std::max(greatest, off.x / bounds->error.x);
  }
  EXPECT_GT(greatest, 0.1);  // the bound is of the size of the error
}

struct Made {
  PatchTopology topology;
  std::vector<PatchLeaf> leaves;
  double extent = 0;
};
Made made(const PieceSource& source) {
  Made all;
  all.extent = test::extent_of(source);
  all.topology = join_pieces(source, all.extent);
  all.leaves = make_leaves(source, all.topology, all.extent);
  return all;
}

// The inequality of leaves, their boxes in space and their parts of the range. Returns how many are not certified.
std::size_t check_leaves(const PieceSource& source, const Made& all, unsigned seed) {
  Uniform uniform(seed);
  std::size_t uncertified = 0;
  std::map<std::uint32_t, double> covered;
  for (const PatchLeaf& leaf : all.leaves) {
    const ParameterBox range = source.range(leaf.piece);
    const dvec2 size = range.upper - range.lower;
    covered[leaf.piece] += 4 * leaf.half.x * leaf.half.y / (size.x * size.y);
    if (leaf.kind != LeafKind::regular) continue;
    const double shorter = std::min(glm::length(leaf.a), glm::length(leaf.b));
    if (!(glm::length(leaf.e) <= largest_graded_remainder * shorter)) uncertified++;
    for (int k = 0; k < 6; k++) {
      const auto corner = [&](int bit) { return k >> bit & 1 ? leaf_reach : -leaf_reach; };
      const dvec2 at = k < 4 ? dvec2(corner(0), corner(1))
                             : dvec2(uniform(-leaf_reach, leaf_reach), uniform(-leaf_reach, leaf_reach));
      const dvec2 place = leaf.centre + leaf.half * at;
      const PatchPoint p = source.at(leaf.piece, place.x, place.y);
      const dvec3 off = glm::abs(leaf.half.x * p.u - leaf.a) + glm::abs(leaf.half.y * p.v - leaf.b);
      const dvec3 rounding = 1e-12 * (glm::abs(leaf.a) + glm::abs(leaf.b)) + 1e-14 * (glm::abs(leaf.m) + 1.0);
      EXPECT_TRUE(below(off, leaf.e + rounding)) << leaf.centre.x << " " << leaf.centre.y;
      const dvec2 inside = leaf.centre + leaf.half * at / leaf_reach;
      const dvec3 position = source.at(leaf.piece, inside.x, inside.y).position;
      EXPECT_TRUE(below(leaf.lower, position + rounding) && below(position - rounding, leaf.upper));
    }
    if (::testing::Test::HasFailure()) return uncertified;
  }
  EXPECT_EQ(covered.size(), source.size());
  for (const auto& [piece, part] : covered) EXPECT_NEAR(part, 1, 1e-9) << piece;
  return uncertified;
}

TEST(Leaves, OfExpressions) {
  const ExpressionSource torus = test::torus(), sphere = test::sphere();
  const Made of_torus = made(torus), of_sphere = made(sphere);
  EXPECT_EQ(check_leaves(torus, of_torus, 1), 0u);
  EXPECT_EQ(check_leaves(sphere, of_sphere, 2), 0u);
  EXPECT_LT(of_torus.leaves.size(), 10000u);
  EXPECT_LT(of_sphere.leaves.size(), 8000u);
}

TEST(Leaves, OfBezierPatches) {
  Uniform uniform(3);
  for (int n = 0; n < 6; n++) {
    const BezierSource source = test::random_patch(uniform, 2 + n % 3, 2 + n % 2, n % 2 == 1);
    EXPECT_EQ(check_leaves(source, made(source), 10 + unsigned(n)), 0u) << n;
  }
}

// The triangles of caps reach beyond the surface's last strip, and lie in its plane.
TEST(Leaves, CapsCloseThePoles) {
  const ExpressionSource source = test::sphere();
  std::map<int, double> angles;
  for (const PatchLeaf& leaf : made(source).leaves) {
    if (leaf.kind != LeafKind::cap) continue;
    EXPECT_NEAR(leaf.m.z, leaf.side == 2 ? 1 : -1, 1e-12);
    EXPECT_LT(glm::length(leaf.a), 2 * cap_reach * widest_cap);
    const double far = source.range(0).lower.y + 2 * leaf.half.y;
    EXPECT_NEAR(glm::length(leaf.b), cap_reach * std::sin(far), 1e-9);
    angles[leaf.side] += std::acos(glm::dot(glm::normalize(leaf.a), glm::normalize(leaf.b)));
    // a is at the least of u.
    EXPECT_NEAR(std::atan2(leaf.a.y, leaf.a.x), std::remainder(leaf.centre.x - leaf.half.x, test::turn), 1e-6);
  }
  EXPECT_NEAR(angles[2], test::turn, 1e-6);
  EXPECT_NEAR(angles[3], test::turn, 1e-6);
}

// What is undefined, creased or singular ends in finitely many leaves; every defined place lies in one, within bounds.
TEST(Leaves, OfSurfacesThatAreNotSmooth) {
  for (const char* z : {"abs(u-0.3*v)", "sqrt(u-0.3*v)", "floor(2*u+0.1)", "1/(u^2+v^2)", "(u^2)^(3/4)"}) {
    const ExpressionSource source({"u", "v", z}, {{-1, -1}, {1, 1}});
    const std::vector<PatchLeaf> leaves = made(source).leaves;
    EXPECT_LT(leaves.size(), 400000u) << z;
    Uniform uniform(5);
    for (int n = 0; n < 200; n++) {
      const dvec2 place{uniform(-1, 1), uniform(-1, 1)};
      const dvec3 p = source.at(0, place.x, place.y).position;
      int found = 0;
      for (const PatchLeaf& leaf : leaves) {
        const dvec2 off = glm::abs(place - leaf.centre);
        if (off.x > leaf.half.x || off.y > leaf.half.y) continue;
        found++;
        EXPECT_TRUE(below(leaf.lower, p) && below(p, leaf.upper)) << z;
      }
      EXPECT_EQ(found, std::isfinite(p.z) ? 1 : 0) << z;
      if (::testing::Test::HasFailure()) return;
    }
  }
}

TEST(Leaves, AreTheSameEveryTime) {
  const ExpressionSource source = test::torus();
  const Made all = made(source);
  std::size_t calls = 0, last = 0;
  const auto again = make_leaves(source, all.topology, all.extent, [&](std::size_t done, std::size_t total) {
    calls++;
    EXPECT_EQ(done, ++last);
    EXPECT_LE(done, total);
  });
  EXPECT_GT(calls, 10u);
  ASSERT_EQ(again.size(), all.leaves.size());
  for (std::size_t i = 0; i < again.size(); i++) EXPECT_EQ(again[i].centre, all.leaves[i].centre);
  EXPECT_THROW(make_leaves(source, all.topology, all.extent, [](std::size_t, std::size_t) { throw 1; }), int);
}

TEST(Leaves, OfFiles) {
  for (const char* name : {"patches/teapot.bpt", "patches/gismo/egg.json", "patches/octant.bez"}) {
    if (!test::has_shared_data(name)) continue;
    const BezierSource source(load_patches(test::shared_data(name)));
    const Made all = made(source);
    EXPECT_EQ(check_leaves(source, all, 6), 0u) << name;
    EXPECT_LT(all.leaves.size(), 60000u) << name;
  }
}

}  // namespace
}  // namespace smurf
