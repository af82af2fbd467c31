// The table of the back-stream method: where the streamlines through the cells of a lattice come from, as they cross a
// curtain through the seed curve (kernels/stream/curtain.inc), and in which cells the stream surface may be.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "flows/queries.hpp"
#include "surfaces/stream/definition.hpp"
#include "surfaces/stream/flow_map.hpp"

namespace smurf {

// A point of the surface that was traced from its seed.
struct StreamSample {
  glm::dvec3 position{0.0};
  double u = 0, tau = 0;
};

// Points in rows, `times` of each of `lines` streamlines spread evenly over the ranges; what there is of them.
struct StreamSamples {
  std::size_t lines = 0, times = 0;
  std::vector<StreamSample> points;  // line by line
  std::vector<bool> there;
  Bounds bounds;  // of those that are there
  // Every line, from the seed to the end of its time, ends where it began.
  bool closed_in_time = false;
};
// Throws Error (input), one line, where there is no surface: no seed in the field, a field that is zero at all of them,
// a seed curve along the flow throughout, streamlines that all end before the range of τ.
StreamSamples sample_stream(FlowQueries& flow, const StreamSurface& surface, std::size_t lines, std::size_t times);

// A chain of straight pieces through the seed curve.
struct Curtain {
  std::vector<double> u;
  std::vector<glm::dvec3> position, across;  // across: the unit vector along v × c'
  double length = 0;                         // of the curve
  double speed = 0;                          // of the field on it, on average
};
Curtain make_curtain(FlowQueries& flow, const StreamSurface& surface, bool closed);

struct Lattice {
  glm::dvec3 corner{0.0};
  double cell = 1;
  glm::ivec3 cells{1};

  glm::ivec3 nodes() const { return cells + 1; }
  std::size_t cell_count() const { return std::size_t(cells.x) * std::size_t(cells.y) * std::size_t(cells.z); }
};
Lattice make_lattice(const Bounds& bounds, int longest);

// Words of cells and branches, as kernels/stream/back_layout.inc has them.
struct BackTable {
  std::vector<std::uint32_t> cells, branches;
  std::size_t full = 0;     // cells that may hold some of the surface
  std::size_t clear = 0;    // branches on which all corners of a cell agree
  std::size_t unclear = 0;  // others
  std::size_t missed = 0;   // tangent planes that samples of the surface add to what the lattice knows
  std::size_t crowded = 0;  // those that a cell has no room for
};
// `nodes`: NODE_WORDS each (kernels/stream/curtain_layout.inc).
BackTable make_back_table(const StreamSurface& surface, const Curtain& curtain, bool closed, const Lattice& lattice,
                          const std::vector<std::uint32_t>& nodes, const StreamSamples& samples);

}  // namespace smurf
