// Streamlines as files, written row by row: no more memory than the lines themselves.
#pragma once

#include <filesystem>

#include "smurf/flow.hpp"

namespace smurf {

// Why a line ends, at the row where it does, else `inside`. A line has its end at the row farthest from the seed in
// time; lines traced both ways also say at their other end why they begin there.
FlowStatus row_status(const Streamlines& lines, std::size_t line, std::size_t row);

// CSV: line,t,status,x,y,z, then ux,uy,uz and uux,uuy,uuz where the lines have them. Numbers read back to the same
// float. VTK XML when the name ends in .vtp: a polyline for each line, a vertex for a line of one position; t, status
// and the variation (u, uu) at points, the number of the line and its status at cells.
// Written whole or not at all; throws Error (io) when that fails.
void write_lines(const Streamlines& lines, const std::filesystem::path& file);

}  // namespace smurf
