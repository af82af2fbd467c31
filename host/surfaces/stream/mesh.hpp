// The mesh of a stream surface: cells between streamlines, each a bicubic Hermite patch.
//
// Cells are boxes of a lattice in (u, τ): whole streamlines are traced at dyadic places of u, and every cell ends at
// dyadic times. A cell is halved in u while the streamline in its middle leaves its patch by more than the tolerance,
// and in τ while the streamlines along its sides do. Where a cell's side is shared with smaller cells, the corners on it
// are those of the larger cell's own patch, so that there is no crack (and no kink).
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "flows/definition.hpp"
#include "patches/bezier.hpp"
#include "patches/topology.hpp"
#include "smurf/stream.hpp"

namespace smurf {

class FlowQueries;
class SeedCurve;

// Corners in the order (least u, least τ), (greatest u, least τ), (least u, greatest τ), (greatest u, greatest τ).
struct StreamCell {
  glm::dvec2 lower{0.0}, upper{0.0};  // in (u, τ)
  // What x_uu and x_ττ at the corners have beyond those of the patch; 0 of fields that are not smooth.
  std::array<glm::dvec3, 4> beyond_uu{}, beyond_vv{};
  // Bounds, by tubes about the middle streamline, of what the true surface's x_u and x_τ differ by from those of the
  // patch, and its position; not finite where there are none: hits are `sampled` there.
  double off = 0, off_u = 0, off_v = 0;
};

struct StreamMesh {
  std::vector<StreamCell> cells;
  std::vector<BezierPiece> pieces;  // one a cell, of degree 3 × 3
  PatchTopology topology;
  Bounds bounds;
  StreamPolygons polygons;

  // What was done.
  std::size_t streamlines = 0;
  std::uint64_t steps = 0;
  std::size_t proved = 0;        // cells
  double deviation = 0;          // the greatest that was measured
  double curvature_error = 0;    // relative, of the interpolated mean curvature, the greatest that was measured
  std::vector<glm::dvec2> gaps;  // ranges of u where the surface is torn: neighbours end or go apart
  std::size_t short_lines = 0;   // that end before the time asked for
  double seconds = 0;
};

struct StreamMeshRequest {
  glm::dvec2 time{0.0, 1.0};
  double tolerance = 0;
};

StreamMesh make_stream_mesh(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& seed,
                            const StreamMeshRequest& request);

}  // namespace smurf
