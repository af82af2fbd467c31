// Tubes: bounds of how far neighbours of a streamline, and their derivatives by u, are from what the streamline says of
// them (by Gronwall's inequality for the variational equations; see Hairer, Nørsett, Wanner 1993, I.10).
//
// For places u within δ of the streamline's, with ρ >= |x(u) - x - x_u (u - u₀)| and η >= |x_u(u) - x_u|:
//   ρ' <= μ ρ + ½ M (|x_u| δ + ρ)²           ρ(0) = ½ |c''| δ²
//   η' <= μ η + M (|x_u| δ + ρ)(|x_u| + η)   η(0) = |c''| δ
// where μ is the greatest eigenvalue of the symmetric part of Dv on the streamline, and M bounds D²v within the tube.
// Streamlines are taken as they were traced: what is proved is proved up to the tolerance of the integrator.
#pragma once

#include "surfaces/stream/cells.hpp"
#include "surfaces/stream/mesh.hpp"

namespace smurf {

// Whether leaves of a cell still exclude and isolate roots of the true surface: with its remainder instead of the
// patch's. `cell` has the bounds.
glm::dvec3 stream_remainder(const StreamCell& cell, const PatchLeaf& leaf);

// Tells of every cell whether tubes prove what its leaves say. As tubes grow with the square of δ, more streamlines
// than the mesh has are traced where that helps. Times begin at the seed.
void prove_cells(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& curve,
                 const StreamCells& cells, StreamMesh& mesh);

}  // namespace smurf
