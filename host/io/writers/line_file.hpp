// Streamlines as files, written row by row: no more memory than the lines themselves.
#pragma once

#include <filesystem>

#include "smurf/flow.hpp"

namespace smurf {

// Why a line ends, at the row where it does, else `inside`. That is the row farthest from the seed in time, the first
// in order of t where the line was traced back. Lines traced both ways also say at their first row why they begin
// there.
FlowStatus row_status(const Streamlines& lines, std::size_t line, std::size_t row);

// CSV: line,t,status,x,y,z, then ux,uy,uz and uux,uuy,uuz where the lines have them, in order of line and t. Numbers
// read back to the same float. VTK XML when the name ends in .vtp: a polyline for each line, a vertex for a line of one
// position; t, status and the variation (u, uu) at points; the line's number, its end and its beginning at cells.
// Written whole or not at all; throws Error (io) when that fails.
void write_lines(const Streamlines& lines, const std::filesystem::path& file);

}  // namespace smurf
