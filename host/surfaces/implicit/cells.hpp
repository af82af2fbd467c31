// The cells that the domain of an expression is cut into on a device, whether it is compiled (resident.cpp) or
// interpreted (tape.cpp), and what the device is told of surface and cells.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/implicit/layout.inc"
#include "surfaces/grid/active_cells.hpp"
#include "surfaces/implicit/definition.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {

// Cubes whose size is a power of two, with their middles at whole multiples of it, so that floats hold them exactly.
struct CellGrid {
  double size = 1;
  glm::dvec3 origin{0.0};
  glm::ivec3 cells{1};

  // With about `most_cells` cells at most along the longest side of the domain, and at least about half as many.
  CellGrid(const Domain& domain, int most_cells);
};

// The uniforms (kernels/implicit/layout.inc), but for the box of active cells.
std::array<std::uint32_t, IMPLICIT_UNIFORM_WORDS> uniform_words(const ImplicitSurface& surface, const CellGrid& grid);

// The cells of a surface's domain on a device: which of them are active, and their Taylor models
// (kernels/implicit/taylor_model.inc).
class ImplicitCells {
 public:
  // All that is referred to must outlive this. The source module "models" makes models.
  ImplicitCells(Executor& executor, const CellGrid& grid, const ActiveCells::Texts& modules,
                const ActiveCells::Texts& defines, DeviceBuffer& uniforms);

  // The cells that the module "cells" leaves over (kernels/implicit/cells.inc).
  std::vector<glm::uvec2> find() { return active_.find(); }
  // Takes of these cells those whose models can be the level. `tape_places` says where the tape of each block stands in
  // `tapes`; both are empty for expressions that are compiled.
  void make(std::vector<glm::uvec2> bits, std::span<const std::uint32_t> tape_places, DeviceBuffer* tapes);

  // What kernels read (kernels/implicit/surface.inc); `tapes` is null for expressions that are compiled.
  BufferGroup buffers(DeviceBuffer* tapes) const {
    return {{"uniforms", &uniforms_},
            {"models", models_.get()},
            {"distances", active_.distances()},
            {"cells", blocks_.get()},
            {"tapes", tapes}};
  }
  std::size_t bytes() const { return active_.bytes() + blocks_.bytes() + models_.bytes(); }

 private:
  void run(std::span<const std::uint32_t> cells, DeviceBuffer& tapes, DeviceBuffer& results, bool marks_only);
  void write_blocks(std::span<const glm::uvec2> bits, std::span<const std::uint32_t> tape_places);

  Executor& executor_;
  const glm::ivec3 cells_;
  const ActiveCells::Texts &modules_, &defines_;
  DeviceBuffer& uniforms_;
  ActiveCells active_;
  TypedBuffer<glm::uvec4> blocks_;  // CELL_BLOCK_WORDS each
  TypedBuffer<float> models_;
  const std::size_t sides_;  // models of a cell: 2 where the function has creases
};

// Whether devices interpret the expression in place of compiling it, which for straight code of this length takes
// compilers minutes.
bool is_interpreted(const ImplicitFunction& function);

// host/surfaces/implicit/tape.cpp
std::unique_ptr<ResidentSurface> reside_as_tape(const ImplicitSurface& surface, Executor& executor);

}  // namespace smurf
