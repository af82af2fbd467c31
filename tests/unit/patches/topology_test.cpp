// Edges, vertices and poles of surfaces whose shape is known.
#include "patches/topology.hpp"

#include <gtest/gtest.h>

#include "harness/devices.hpp"
#include "harness/files/shared_data.hpp"
#include "io/patch_file.hpp"
#include "unit/patches/surfaces.hpp"

namespace smurf {
namespace {

using glm::dvec3;

PatchTopology joined(const PieceSource& source, std::array<bool, 2> closed = {}) {
  return join_pieces(source, test::extent_of(source), closed);
}
std::size_t turned(const PatchTopology& topology) {
  std::size_t count = 0;
  for (const PieceBorders& borders : topology.pieces) count += std::size_t(std::ranges::count(borders.turned, true));
  return count;
}

TEST(Topology, OfATorus) {
  const PatchTopology t = joined(test::torus());
  EXPECT_EQ(t.edges, 2u);
  EXPECT_EQ(t.open_sides, 0u);
  EXPECT_EQ(t.vertices, 1u);
  EXPECT_TRUE(t.poles.empty());
  EXPECT_EQ(turned(t), 0u);
  EXPECT_EQ(t.pieces[0].edges[0], t.pieces[0].edges[1]);
  EXPECT_EQ(t.pieces[0].edges[2], t.pieces[0].edges[3]);
  EXPECT_NE(t.pieces[0].edges[0], t.pieces[0].edges[2]);
}

TEST(Topology, OfASphere) {
  const PatchTopology t = joined(test::sphere());
  EXPECT_EQ(t.edges, 1u);
  EXPECT_EQ(t.open_sides, 0u);
  EXPECT_EQ(t.vertices, 2u);
  EXPECT_EQ(t.pieces[0].collapsed, (std::array<bool, 4>{false, false, true, true}));
  ASSERT_EQ(t.poles.size(), 2u);
  for (const Pole& pole : t.poles) {
    EXPECT_TRUE(pole.has_normal);
    EXPECT_TRUE(pole.has_curvature);
    // x_u × x_v points inwards.
    EXPECT_LT(glm::length(pole.normal + pole.position), 1e-9);
    const glm::dmat3 exact(dvec3(-1, 0, 0), dvec3(0, -1, 0), dvec3(0));
    for (int c = 0; c < 3; c++) EXPECT_LT(glm::length(pole.shape[c] - exact[c]), 1e-5);
  }
  EXPECT_NEAR(t.poles[0].position.z * t.poles[1].position.z, -1, 1e-12);
}

TEST(Topology, OfAConeWhoseApexHasNoNormal) {
  const PatchTopology t = joined(test::cone());
  EXPECT_EQ(t.open_sides, 1u);
  ASSERT_EQ(t.poles.size(), 1u);
  EXPECT_FALSE(t.poles[0].has_normal);
  EXPECT_FALSE(t.poles[0].has_curvature);
}

// The tip of z = r^(3/2), by u = angle and v = r: a normal, but no curvature.
TEST(Topology, OfATipWithoutCurvature) {
  const PatchTopology t = joined(ExpressionSource({"v^2*cos(u)", "v^2*sin(u)", "v^3"}, {{0, 0}, {test::turn, 1}}));
  ASSERT_EQ(t.poles.size(), 1u);
  EXPECT_TRUE(t.poles[0].has_normal);
  EXPECT_FALSE(t.poles[0].has_curvature);
  EXPECT_NEAR(std::abs(t.poles[0].normal.z), 1, 1e-5);
}

TEST(Topology, OfAKleinBottleWhoseSeamIsTurned) {
  const PatchTopology t = joined(test::klein_bottle());
  EXPECT_EQ(t.edges, 2u);
  EXPECT_EQ(t.open_sides, 0u);
  EXPECT_EQ(t.vertices, 1u);
  EXPECT_EQ(t.pieces[0].turned, (std::array<bool, 4>{true, true, false, false}));
}

TEST(Topology, ClosesWhatIsSaidToBeClosed) {
  const ExpressionSource source({"cos(u)", "sin(u)", "v"}, {{0, 0}, {6.2831, 1}});
  EXPECT_EQ(joined(source).open_sides, 4u);
  const PatchTopology t = joined(source, {true, false});
  EXPECT_EQ(t.open_sides, 2u);
  EXPECT_EQ(t.edges, 1u);
  EXPECT_EQ(t.vertices, 2u);
  EXPECT_NEAR(t.greatest_gap, test::turn - 6.2831, 1e-6);
  EXPECT_EQ(joined(ExpressionSource({"cos(u)", "sin(u)", "v"}, {{0, 0}, {6.2831853, 1}})).open_sides, 2u);
}

// Three half planes about one line: no two of them are neighbours.
TEST(Topology, LeavesBranchingSidesOpen) {
  std::vector<Patch> patches;
  for (int n = 0; n < 3; n++) {
    const double x = std::cos(2.0 * n), y = std::sin(2.0 * n);
    patches.push_back(bezier_patch(1, 1, {{0, 0, 0, 1}, {x, y, 0, 1}, {0, 0, 1, 1}, {x, y, 1, 1}}));
  }
  const PatchTopology t = joined(BezierSource(patches));
  EXPECT_EQ(t.edges, 0u);
  EXPECT_EQ(t.branching_sides, 3u);
  EXPECT_EQ(t.open_sides, 12u);
  EXPECT_EQ(t.vertices, 8u);
}

TEST(Topology, WeldsToTheBitAndElevatesExactly) {
  // The second patch comes reversed, and off by less than the tolerance.
  const double off = 3e-7;
  const std::vector<Patch> patches{
      bezier_patch(1, 1, {{0, 0, 0, 1}, {1, 0, 0, 1}, {0, 1, 0, 1}, {1, 1, 0, 1}}),
      bezier_patch(1, 1, {{1, 1 + off, 0, 1}, {2, 1, 0, 1}, {1 - off, 0, off, 1}, {2, 0, 0, 1}})};
  const BezierSource source(patches);
  EXPECT_EQ(source.pieces()[0].points[1], source.pieces()[1].points[2]);
  EXPECT_EQ(source.pieces()[0].points[3], source.pieces()[1].points[0]);
  const PatchTopology t = joined(source);
  EXPECT_EQ(t.edges, 1u);
  EXPECT_EQ(turned(t), 2u);
  EXPECT_EQ(t.vertices, 6u);
  EXPECT_EQ(t.greatest_gap, 0);
  EXPECT_NE(BezierSource(patches, 1e-8).pieces()[0].points[1], patches[1].points[2]);

  test::Uniform uniform(1);
  const BezierSource rational = test::random_patch(uniform, 2, 3, true);
  const BezierPiece raised = elevated(rational.pieces()[0], 4, 5);
  EXPECT_EQ(raised.points.size(), 30u);
  for (int n = 0; n < 20; n++) {
    const double u = uniform(0, 1), v = uniform(0, 1);
    const PatchPoint a = rational.at(0, u, v), b = evaluate_unit(raised, u, v);
    EXPECT_LT(glm::length(a.position - b.position), 1e-11);
    EXPECT_LT(glm::length(a.uv - b.uv), 1e-9);
  }
}

TEST(Topology, OfFiles) {
  if (test::has_shared_data("patches/gismo/egg.json")) {
    const PatchTopology t = joined(BezierSource(load_patches(test::shared_data("patches/gismo/egg.json"))));
    EXPECT_EQ(t.open_sides, 0u);
    EXPECT_EQ(t.poles.size(), 2u);
    EXPECT_EQ(t.vertices + t.pieces.size(), t.edges + 2);  // Euler, of a sphere
  }
  if (test::has_shared_data("patches/teapot.bpt")) {
    const PatchTopology t = joined(BezierSource(load_patches(test::shared_data("patches/teapot.bpt"))));
    EXPECT_EQ(t.edges, 52u);
    EXPECT_EQ(t.open_sides, 16u);
    EXPECT_EQ(t.poles.size(), 2u);
    for (const Pole& pole : t.poles) EXPECT_NEAR(std::abs(pole.normal.z), 1, 1e-6);
  }
  if (test::has_shared_data("patches/gismo/g_plus_s_surf.json")) {
    const BezierSource source(load_patches(test::shared_data("patches/gismo/g_plus_s_surf.json")));
    const PatchTopology t = joined(source);
    EXPECT_EQ(2 * t.edges + t.open_sides, 4 * source.size());
    EXPECT_LT(t.open_sides, 100u);
    EXPECT_LT(t.greatest_gap, 1e-6 * 93.2);
  }
}

}  // namespace
}  // namespace smurf
