// Curvilinear blocks to test with, and where points lie in their cells: in double precision, by asking every cell whose
// box reaches near the point. Shares no code with what it judges.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "smurf/flow.hpp"

namespace smurf::test {

using PlaceOf = std::function<glm::dvec3(const glm::dvec3&)>;

// Nodes at place(i/(nx-1), j/(ny-1), k/(nz-1)), with the vectors that the field has there.
CurvilinearBlock block_of(const glm::ivec3& size, const PlaceOf& place, const PlaceOf& field);

// A PLOT3D grid and solution of one block, in floats of the other byte order, without blanking: velocity is momentum
// over density.
CurvilinearBlock read_plot3d_block(const std::filesystem::path& grid, const std::filesystem::path& solution);

struct CellTruth {
  std::int64_t cell = -1;
  glm::dvec3 local{0.0};
  double depth = 0;        // how far inside of the cell, at least, in units of space along an axis; negative: outside
  glm::dvec3 reach{0.0};   // how much local coordinates change where each coordinate in space changes by 1
  bool irregular = false;  // decided by tetrahedra
  bool only_between = false;  // by the tetrahedra of a cell beside an irregular one, which counts where nothing else is
  glm::dvec3 value{0.0};      // the field there
  glm::dmat3 by_local{0.0};   // its derivatives by local coordinates
};

class CellTruths {
 public:
  explicit CellTruths(std::vector<CurvilinearBlock> blocks);
  // All cells that contain the point, or miss it by `tolerance` at most, in order of their numbers.
  std::vector<CellTruth> about(const glm::dvec3& point, double tolerance) const;
  double size() const { return size_; }  // half the extent
  std::size_t irregular_cells() const { return irregular_cells_; }
  // A place in a cell that is chosen at random.
  glm::dvec3 random_place(std::mt19937& random) const;

 private:
  struct Cell {
    glm::dvec3 corners[8], vectors[8];
    glm::dvec3 lower, upper;
    bool irregular = false, beside = false;
  };
  void find_irregular(std::size_t first, const glm::ivec3& size);

  std::vector<Cell> cells_;
  std::vector<std::vector<std::uint32_t>> slabs_;  // across x
  glm::dvec3 lower_, upper_;
  double size_ = 0;
  std::size_t irregular_cells_ = 0;
};

}  // namespace smurf::test
