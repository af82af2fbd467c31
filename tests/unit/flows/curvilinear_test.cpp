// What curvilinear and rectilinear fields refuse, and what they say of themselves.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "flows/definition.hpp"
#include "harness/files/shared_data.hpp"
#include "harness/refusal.hpp"
#include "truth/flow/curvilinear.hpp"

namespace smurf::test {
namespace {

glm::dvec3 same(const glm::dvec3& p) { return p; }

CurvilinearBlock box() { return block_of({3, 4, 5}, same, same); }

std::string refused(CurvilinearBlock block, double tolerance = 0) {
  return refusal(ErrorCode::input, [&] {
    std::vector<CurvilinearBlock> blocks{box()};
    blocks.push_back(std::move(block));
    curvilinear_flow(std::move(blocks), VectorReconstruction::trilinear, tolerance);
  });
}

std::string fact(const VectorField& field, std::string_view name) {
  for (const Fact& fact : field.model().facts())
    if (fact.name == name) return fact.value;
  return "there is no such fact";
}

TEST(CurvilinearFlow, RefusesWhatIsNoBlock) {
  CurvilinearBlock block = box();
  block.size.y = 1;
  EXPECT_EQ(refused(block), "block 1 must have at least 2 nodes along each axis, not 3 x 1 x 5");
  block = box();
  block.points.pop_back();
  EXPECT_EQ(refused(block), "block 1 of 3 x 4 x 5 nodes must have 60 points, not 59");
  block = box();
  block.vectors.pop_back();
  EXPECT_EQ(refused(block), "block 1 of 3 x 4 x 5 nodes must have 60 vectors, not 59");
  block = box();
  block.blanked.resize(2);
  EXPECT_EQ(refused(block), "block 1 of 3 x 4 x 5 nodes must have 60 marks of blanked nodes, not 2");
  block = box();
  block.points[7].y = std::numeric_limits<double>::infinity();
  EXPECT_NE(refused(block).find("node 7 of block 1 must stand at a finite point"), std::string::npos);
  EXPECT_NE(refused(box(), -1).find("tolerance"), std::string::npos);
  EXPECT_NE(refused(box(), std::nan("")).find("tolerance"), std::string::npos);
  EXPECT_EQ(refusal(ErrorCode::input, [] { curvilinear_flow({}); }),
            "a curvilinear field must have at least one block");
  block = box();
  for (glm::dvec3& point : block.points) point = glm::dvec3(1);
  EXPECT_NE(refusal(ErrorCode::input, [&] { curvilinear_flow({block}); }).find("one point"), std::string::npos);
}

TEST(CurvilinearFlow, RefusesAxesThatDoNotIncrease) {
  const auto refused_axes = [](const std::array<std::vector<double>, 3>& axes, std::size_t vectors) {
    return refusal(ErrorCode::input, [&] { rectilinear_flow(axes, Values<glm::vec3>(vectors, glm::vec3(1))); });
  };
  EXPECT_EQ(refused_axes({{{0, 1}, {0, 2, 2}, {0, 1}}}, 12),
            "the nodes of a rectilinear field along y must increase, but 2 follows 2");
  EXPECT_EQ(refused_axes({{{0, 1}, {0, 2}, {0}}}, 4), "a rectilinear field must have at least 2 nodes along z, not 1");
  EXPECT_NE(refused_axes({{{0, std::nan("")}, {0, 2}, {0, 1}}}, 8).find("must be finite"), std::string::npos);
  EXPECT_EQ(refused_axes({{{0, 1}, {0, 2}, {0, 1}}}, 7),
            "a rectilinear field of 2 x 2 x 2 nodes must have 8 vectors, not 7");
}

TEST(CurvilinearFlow, SaysWhatItIs) {
  CurvilinearBlock block = box();
  block.blanked.assign(60, 0);
  block.blanked[0] = 1;
  block.vectors[59].x = std::numeric_limits<float>::quiet_NaN();
  block.vectors[0] = glm::vec3(100);  // blanked: it does not count
  const VectorField field = curvilinear_flow({box(), block}, VectorReconstruction::tricubic);
  EXPECT_EQ(field.kind(), "curvilinear");
  EXPECT_EQ(fact(field, "blocks"), "2: 3 x 4 x 5, 3 x 4 x 5");
  EXPECT_EQ(fact(field, "nodes"), "120");
  EXPECT_EQ(fact(field, "cells"), "48");
  EXPECT_EQ(fact(field, "inverted cells"), "0");
  EXPECT_EQ(fact(field, "blanked cells"), "1");
  EXPECT_EQ(fact(field, "seams"), "none");
  EXPECT_EQ(fact(field, "reconstruction"), "tricubic");
  EXPECT_EQ(fact(field, "not finite"), "1 vectors are NaN or infinite: the field is undefined in their cells");
  EXPECT_NEAR(field.model().greatest_speed(), std::sqrt(3.0), 1e-6);
  EXPECT_EQ(field.bounds().upper, glm::dvec3(1));
  EXPECT_EQ(rectilinear_flow({{{0, 1}, {0, 1}, {0, 1}}}, Values<glm::vec3>(8, glm::vec3(1))).kind(), "rectilinear");
}

TEST(CurvilinearFlow, KnowsTheDataOfPlot3d) {
  if (!has_shared_data("vectors/combxyz.bin") || !has_shared_data("vectors/cylinderxyz.bin")) GTEST_SKIP();
  const VectorField combustor =
      curvilinear_flow({read_plot3d_block(shared_data("vectors/combxyz.bin"), shared_data("vectors/combq.bin"))});
  EXPECT_EQ(fact(combustor, "blocks"), "1: 57 x 33 x 25");
  // Corner Jacobians of cells (39, 0, 0) and (39, 31, 0), mirror images, are -0.05 of the product of their edges.
  EXPECT_EQ(fact(combustor, "inverted cells"), "2");
  EXPECT_EQ(fact(combustor, "seams"), "none");
  const VectorField cylinder = curvilinear_flow(
      {read_plot3d_block(shared_data("vectors/cylinderxyz.bin"), shared_data("vectors/cylinderq.bin"))});
  EXPECT_EQ(fact(cylinder, "seams"), "block 0 along i");
  EXPECT_EQ(fact(cylinder, "degenerate cells"), "0");
}

}  // namespace
}  // namespace smurf::test
