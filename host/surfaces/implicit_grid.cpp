#include "surfaces/implicit_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "surfaces/active_cells.hpp"

namespace smurf {

CellGrid::CellGrid(const ImplicitDomain& domain, int most_cells) {
  const glm::dvec3 extent = domain.upper - domain.lower;
  const double longest = std::max({extent.x, extent.y, extent.z, 1e-30});
  size = std::exp2(std::ceil(std::log2(longest / (most_cells - 1))));
  origin = size * glm::floor(domain.lower / size);
  cells = glm::max(glm::ivec3(glm::ceil((domain.upper - origin) / size)), glm::ivec3(1));
}

std::array<std::uint32_t, IMPLICIT_PARAMETER_WORDS> parameter_words(const ImplicitSurface& surface,
                                                                    const CellGrid& grid) {
  std::array<std::uint32_t, IMPLICIT_PARAMETER_WORDS> words{};
  const auto put_integer = [&](int at, int value) { words[std::size_t(at)] = std::uint32_t(value); };
  const auto put_real = [&](int at, double value) {
    words[std::size_t(at)] = std::bit_cast<std::uint32_t>(float(value));
  };
  const glm::ivec3 blocks = ActiveCells::blocks_of(grid.cells);
  put_integer(GRID_BLOCKS, blocks.x);
  put_integer(GRID_BLOCKS + 1, blocks.y);
  for (int axis = 0; axis < 3; axis++) {
    put_integer(GRID_SIZE + axis, grid.cells[axis] + 1);
    put_real(GRID_EXTENT + axis, grid.cells[axis]);
    put_real(GRID_ORIGIN_HIGH + axis, grid.origin[axis]);
    put_real(GRID_ORIGIN_LOW + axis, grid.origin[axis] - double(float(grid.origin[axis])));
    put_real(GRID_MATRIX_HIGH + 4 * axis, 1 / grid.size);
    put_real(IMPLICIT_LOWER + axis, surface.domain.lower[axis]);
    put_real(IMPLICIT_UPPER + axis, surface.domain.upper[axis]);
  }
  put_real(IMPLICIT_RADIUS, surface.domain.radius);
  put_real(IMPLICIT_LEVEL, surface.level);
  put_real(IMPLICIT_SIDE, int(surface.side));
  put_real(IMPLICIT_CELL, grid.size);
  return words;
}

bool is_interpreted(const ImplicitFunction& function) {
  constexpr std::size_t most_compiled = 400;
  const char* wanted = std::getenv("SMURF_COMPILE_OPERATIONS");
  const std::vector<expression::NodeId> value{function.value};
  const std::size_t operations = expression::reachable(function.graph, value).size();
  return operations > (wanted ? std::strtoul(wanted, nullptr, 10) : most_compiled);
}

}  // namespace smurf
