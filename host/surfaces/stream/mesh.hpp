// The mesh of a stream surface: cells between streamlines, each a bicubic Hermite patch.
//
// Cells are boxes of a lattice in (u, τ) (surfaces/stream/cells.hpp): whole streamlines are traced at dyadic places of
// u, and every cell ends at dyadic rows of time. A cell is halved in u while the streamline in its middle leaves its
// patch by more than the tolerance, and in τ while the streamlines along its sides do. Where a cell's side is shared
// with smaller cells, the corners on it are those of the larger cell's own patch, so that there is no crack.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "flows/definition.hpp"
#include "patches/bezier_source.hpp"
#include "patches/leaves.hpp"
#include "patches/topology.hpp"
#include "smurf/stream.hpp"

namespace smurf {

class FlowQueries;
class SeedCurve;

struct StreamCell {
  glm::dvec2 lower{0.0}, upper{0.0};  // in (u, τ)
  // What x_uu and x_ττ have beyond those of the patch, at (least u, least τ), (greatest u, least τ), (least u, greatest
  // τ), (greatest u, greatest τ); 0 of fields that are not smooth.
  std::array<glm::dvec3, 4> beyond_uu{}, beyond_vv{};
  double curvature_error = 0;  // of the interpolated curvature, relative, as far as it was measured
  // Tubes about streamlines prove that the derivatives of the true surface by u and τ are within off_u and off_v of the
  // patch's, also an eighth of the cell beyond its sides, so that what leaves prove of the patch they prove of it.
  // `proved`: rays that are not too oblique have at most one root in a leaf.
  bool proved = false;
  double off_u = INFINITY, off_v = INFINITY;
};

// What lies at a border of the domain, where streamlines end within it: nothing is known but the box.
struct StreamBorder {
  glm::dvec2 lower{0.0}, upper{0.0};  // in (u, τ)
  SpaceBox space{};
};

struct StreamMesh {
  std::vector<StreamCell> cells;
  std::shared_ptr<const BezierSource> pieces;  // one a cell, of degree 3 × 3
  std::vector<StreamBorder> borders;
  PatchTopology topology;
  std::vector<PatchLeaf> leaves;  // of the cells
  Bounds bounds;
  StreamPolygons polygons;
  bool is_smooth = false;

  // The cell of a place: first which of `base` boxes, u by u, then by halves. Each node of `tree` is the number of its
  // first child (the other one follows) times 2, plus 1 where it is halved in τ; or -1 less the number of the cell; or
  // no_cell.
  static constexpr std::int32_t no_cell = -0x7fffffff;
  glm::ivec2 base{1};
  glm::dvec2 lower{0.0}, upper{0.0};  // of u and τ
  std::vector<double> base_times;     // τ where boxes meet, and of both ends
  std::vector<std::int32_t> tree;

  // What was done.
  std::size_t streamlines = 0, short_lines = 0;  // the latter end before the time asked for
  std::uint64_t steps = 0;
  std::size_t proved = 0;        // cells
  double deviation = 0;          // the greatest that was measured
  double curvature_error = 0;    // the greatest
  std::vector<glm::dvec2> gaps;  // ranges of u where the surface is torn
  double seconds = 0;
};

// Throws Error (input) where the seed curve lies outside of the field, is zero of it, or runs along it; Error (memory)
// where the tolerance cannot be met.
StreamMesh make_stream_mesh(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& seed,
                            const glm::dvec2& time, double tolerance);

}  // namespace smurf
