#include "surfaces/implicit/cells.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "surfaces/grid/active_cells.hpp"

namespace smurf {

CellGrid::CellGrid(const Domain& domain, int most_cells) {
  const glm::dvec3 extent = domain.upper - domain.lower;
  const double longest = std::max({extent.x, extent.y, extent.z, 1e-30});
  size = std::exp2(std::ceil(std::log2(longest / (most_cells - 1))));
  // Planes at round numbers, which are common, then lie in the middle of cells and not between them.
  origin = size * (glm::floor(domain.lower / size) - 0.5);
  cells = glm::max(glm::ivec3(glm::ceil((domain.upper - origin) / size)), glm::ivec3(1));
}

std::array<std::uint32_t, IMPLICIT_UNIFORM_WORDS> uniform_words(const ImplicitSurface& surface, const CellGrid& grid) {
  std::array<std::uint32_t, IMPLICIT_UNIFORM_WORDS> words{};
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
    put_real(IMPLICIT_DOMAIN + axis, surface.domain.lower[axis]);
    put_real(IMPLICIT_DOMAIN + 3 + axis, surface.domain.upper[axis]);
  }
  put_real(IMPLICIT_DOMAIN + 6, surface.domain.radius);
  // What devices would take for zero is rounded away from it.
  const double least = double(std::numeric_limits<float>::min());
  const bool small = surface.level != 0 && std::abs(surface.level) < least;
  put_real(IMPLICIT_LEVEL, small ? std::copysign(least, surface.level) : surface.level);
  put_real(IMPLICIT_SIDE, int(surface.side));
  put_real(IMPLICIT_CELL, grid.size);
  return words;
}

ImplicitCells::ImplicitCells(Executor& executor, const CellGrid& grid, const ActiveCells::Texts& modules,
                             const ActiveCells::Texts& defines, DeviceBuffer& uniforms)
    : executor_(executor),
      cells_(grid.cells),
      modules_(modules),
      defines_(defines),
      uniforms_(uniforms),
      active_(executor, grid.cells, modules, defines, uniforms, uniforms, uniforms),
      blocks_(executor, active_.block_count(), "blocks of cells"),
      sides_(defines.at("SIDES") == "2" ? 2 : 1) {}

namespace {

// Cells by their place in the blocks: 64 times the block's number and the cell's bit.
std::vector<std::uint32_t> listed(std::span<const glm::uvec2> bits) {
  std::vector<std::uint32_t> list;
  for (std::size_t block = 0; block < bits.size(); block++) {
    std::uint64_t word = bits[block].x | std::uint64_t(bits[block].y) << 32;
    for (; word != 0; word &= word - 1) list.push_back(std::uint32_t(64 * block + std::size_t(std::countr_zero(word))));
  }
  return list;
}

}  // namespace

void ImplicitCells::make(std::vector<glm::uvec2> bits, std::span<const std::uint32_t> tape_places,
                         DeviceBuffer* tapes) {
  write_blocks(bits, tape_places);
  // What is not used must still be something.
  DeviceBuffer& tape_words = tapes ? *tapes : uniforms_;
  const std::vector<std::uint32_t> candidates = listed(bits);
  if (!candidates.empty()) {
    TypedBuffer<std::uint32_t> marks(executor_, candidates.size(), "cells that reach the level");
    run(candidates, tape_words, *marks.get(), true);
    std::vector<std::uint32_t> reaches(candidates.size());
    marks.read(reaches);
    for (std::size_t i = 0; i < candidates.size(); i++) {
      const std::uint32_t bit = candidates[i] % 64;
      if (reaches[i] == 0) bits[candidates[i] / 64][int(bit / 32)] &= ~(1u << (bit % 32));
    }
  }
  active_.activate(bits, glm::vec3(cells_));
  write_blocks(bits, tape_places);
  const std::vector<std::uint32_t> active = listed(bits);
  // Lanes without a ray read what comes after the last; behind it stand the models of the other sides.
  models_ = TypedBuffer<float>(executor_, (sides_ * active.size() + 1) * MODEL_WORDS, "Taylor models");
  models_.write(std::vector<float>(MODEL_WORDS, 0.0f), active.size() * MODEL_WORDS);
  if (!active.empty()) run(active, tape_words, *models_.get(), false);
}

void ImplicitCells::write_blocks(std::span<const glm::uvec2> bits, std::span<const std::uint32_t> tape_places) {
  std::vector<glm::uvec4> blocks;
  blocks.reserve(bits.size());
  std::uint32_t models = 0;
  for (std::size_t i = 0; i < bits.size(); i++) {
    blocks.emplace_back(bits[i], models, tape_places.empty() ? 0 : tape_places[i]);
    models += std::uint32_t(std::popcount(bits[i].x) + std::popcount(bits[i].y));
  }
  blocks_.write(blocks);
}

void ImplicitCells::run(std::span<const std::uint32_t> cells, DeviceBuffer& tapes, DeviceBuffer& results,
                        bool marks_only) {
  TypedBuffer<std::uint32_t> list(executor_, cells.size(), "cells in order");
  list.write(cells);
  launch(executor_, Program{KernelId::implicit_models, modules_, defines_},
         arguments::implicit_models{.uniforms = &uniforms_,
                                    .cells = blocks_.get(),
                                    .tapes = &tapes,
                                    .list = list.get(),
                                    .models = &results,
                                    .count = int(cells.size()),
                                    .marks_only = marks_only ? 1 : 0},
         cells.size());
  executor_.finish();
}

bool is_interpreted(const ImplicitFunction& function) {
  constexpr std::size_t most_compiled = 400;
  const char* wanted = std::getenv("SMURF_COMPILE_OPERATIONS");
  const std::vector<expression::NodeId> value{function.value};
  const std::size_t operations = expression::reachable(function.graph, value).size();
  return operations > (wanted ? std::strtoul(wanted, nullptr, 10) : most_compiled);
}

}  // namespace smurf
