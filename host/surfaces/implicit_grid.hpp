// The cells that the domain of an expression is cut into on a device, and what the device is told of surface and cells.
#pragma once

#include <array>
#include <cstdint>

#include "implicit_parameters.inc"
#include "surfaces/implicit.hpp"

namespace smurf {

// Cubes whose size is a power of two, at whole multiples of it, so that floats hold their middles exactly.
struct CellGrid {
  double size = 1;
  glm::dvec3 origin{0.0};
  glm::ivec3 cells{1};

  // With at most `most_cells` cells along the longest side of the domain, and at least about half as many.
  CellGrid(const ImplicitDomain& domain, int most_cells);
};

// The parameter buffer (implicit_parameters.inc), but for the box of active cells.
std::array<std::uint32_t, IMPLICIT_PARAMETER_WORDS> parameter_words(const ImplicitSurface& surface,
                                                                    const CellGrid& grid);

// Whether devices interpret the expression in place of compiling it, which for straight code of this length takes compilers minutes.
bool is_interpreted(const ImplicitFunction& function);

// host/surfaces/implicit_tape.cpp
std::unique_ptr<ResidentSurface> reside_as_tape(const ImplicitSurface& surface, Executor& executor);

}  // namespace smurf
