// The geometry of curvilinear blocks on the host: corner Jacobians, seams, and which cells are about a point.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "fields/curvilinear_cells.hpp"
#include "fields/voxel_tables.hpp"

namespace smurf {
namespace {

template <class Place>
std::vector<glm::dvec3> nodes(const glm::ivec3& size, const Place& place) {
  std::vector<glm::dvec3> points;
  for (int k = 0; k < size.z; k++)
    for (int j = 0; j < size.y; j++)
      for (int i = 0; i < size.x; i++) points.push_back(place(glm::dvec3(i, j, k)));
  return points;
}

TEST(CurvilinearCells, JacobiansAreThoseOfTheEdgesRelativeToTheirLength) {
  const glm::ivec3 size(2);
  // Edges 2, 3 and 5 long; the third leans by 60 degrees towards the first.
  const auto points = nodes(size, [](const glm::dvec3& u) {
    return glm::dvec3(2 * u.x + 5 * 0.5 * u.z, 3 * u.y, 5 * std::sqrt(0.75) * u.z);
  });
  for (const double jacobian : corner_jacobians(corners_of(size, points, {0, 0, 0})))
    EXPECT_NEAR(jacobian, std::sqrt(0.75), 1e-14);
}

TEST(CurvilinearCells, ThinCellsAreNotDegenerate) {
  const glm::ivec3 size(3, 3, 3);
  const auto points = nodes(size, [](const glm::dvec3& u) { return glm::dvec3(u.x, 1e-9 * u.y, 1e3 * u.z); });
  const CellExamination found = examine_cells(size, points);
  EXPECT_EQ(found.inverted, 0u);
  EXPECT_EQ(found.degenerate, 0u);
  EXPECT_EQ(found.sense, 1);
}

TEST(CurvilinearCells, LeftHandedBlocksAreNotInverted) {
  const glm::ivec3 size(3, 4, 5);
  const auto points = nodes(size, [](const glm::dvec3& u) { return glm::dvec3(-u.x, u.y, u.z); });
  const CellExamination found = examine_cells(size, points);
  EXPECT_EQ(found.sense, -1);
  EXPECT_EQ(found.inverted, 0u);
  EXPECT_EQ(found.degenerate, 0u);
  for (const std::uint8_t irregular : found.irregular) EXPECT_EQ(irregular, 0);
}

TEST(CurvilinearCells, OneNodeTooFarInvertsTheCellsBesideIt) {
  const glm::ivec3 size(5, 5, 5);
  auto points = nodes(size, [](const glm::dvec3& u) { return u; });
  points[node_at(size, 2, 2, 2)].x = 3.5;
  const CellExamination found = examine_cells(size, points);
  // Of the eight cells about the node, the four that it has left behind keep their sense.
  EXPECT_EQ(found.inverted, 4u);
  EXPECT_EQ(found.degenerate, 0u);
  const glm::ivec3 cells = size - 1;
  EXPECT_EQ(found.irregular[node_at(cells, 2, 1, 1)], 1);
  EXPECT_EQ(found.irregular[node_at(cells, 1, 1, 1)], 0);
}

TEST(CurvilinearCells, CollapsedEdgesAreDegenerate) {
  const glm::ivec3 size(9, 4, 3);
  const auto points = nodes(size, [](const glm::dvec3& u) {
    const double angle = 2 * std::numbers::pi * u.x / 8;
    return glm::dvec3(u.y * std::cos(angle), u.y * std::sin(angle), u.z);
  });
  const CellExamination found = examine_cells(size, points);
  EXPECT_EQ(found.degenerate, 8u * 2u);
  EXPECT_EQ(found.inverted, 0u);
  EXPECT_EQ(find_seams(size, points, 1e-9), (std::array<bool, 3>{true, false, false}));
}

TEST(CurvilinearCells, SeamsAreWhereAllNodesMeet) {
  const glm::ivec3 size(3, 9, 3);
  const auto place = [](const glm::dvec3& u) {
    const double angle = 2 * std::numbers::pi * u.y / 8;
    return glm::dvec3((1 + u.x) * std::cos(angle), (1 + u.x) * std::sin(angle), u.z);
  };
  auto points = nodes(size, place);
  EXPECT_EQ(find_seams(size, points, 1e-9), (std::array<bool, 3>{false, true, false}));
  points[node_at(size, 2, 8, 1)].z += 1e-6;
  EXPECT_EQ(find_seams(size, points, 1e-9), (std::array<bool, 3>{false, false, false}));
}

// Boxes from 1e-4 to 1 wide, which crowd about a corner.
TEST(VoxelTables, EveryBoxAboutAPointIsListedInOrder) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<CellBox> boxes;
  for (int i = 0; i < 3000; i++) {
    const float size = std::pow(10.0f, -4 * unit(random));
    const glm::vec3 corner = glm::vec3(unit(random), unit(random), unit(random)) * (i % 2 == 0 ? 1.0f : 1.5f * size);
    const float x = unit(random), y = unit(random), z = unit(random);
    boxes.push_back({corner, corner + size * glm::vec3(x, y, z)});
  }
  const float slack = 1e-6f;
  const VoxelTables tables = build_voxel_tables(boxes, slack);
  EXPECT_GT(tables.tables.size(), 12u) << "no voxel is divided";
  std::size_t listed = 0, points = 0;
  for (int i = 0; i < 4000; i++) {
    const float size = i % 2 == 0 ? 1.2f : 1e-3f;
    const glm::vec3 point = size * glm::vec3(unit(random), unit(random), unit(random)) - 0.05f * size;
    const auto about = cells_about(tables, point);
    EXPECT_TRUE(std::is_sorted(about.begin(), about.end()));
    for (std::size_t box = 0; box < boxes.size(); box++) {
      const bool holds = glm::all(glm::greaterThanEqual(point, boxes[box].lower - slack)) &&
                         glm::all(glm::lessThanEqual(point, boxes[box].upper + slack));
      const bool listed_there = std::binary_search(about.begin(), about.end(), std::uint32_t(box));
      EXPECT_TRUE(listed_there || !holds) << box;
    }
    listed += about.size();
    points++;
  }
  EXPECT_LT(double(listed) / double(points), 300);
}

TEST(VoxelTables, OneBoxAndManyThatAreTheSame) {
  const std::vector<CellBox> boxes(1000, {glm::vec3(1, 2, 3), glm::vec3(2, 2, 7)});
  const VoxelTables tables = build_voxel_tables(boxes, 1e-6f);
  EXPECT_EQ(cells_about(tables, {1.5f, 2, 4}).size(), 1000u);
  EXPECT_EQ(cells_about(tables, {1.5f, 2.1f, 4}).size(), 0u);
  EXPECT_EQ(cells_about(build_voxel_tables({boxes.data(), 1}, 1e-6f), {1.5f, 2, 4}).size(), 1u);
}

}  // namespace
}  // namespace smurf
