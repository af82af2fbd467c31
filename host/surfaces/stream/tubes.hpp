// Tubes: bounds of how far neighbours of a streamline, and their derivatives by u, are from what the streamline says of
// them (by Gronwall's inequality for the variational equations; see Hairer, Nørsett, Wanner 1993, I.10).
//
// For places u within δ of the streamline's, with ρ >= |x(u) - x - x_u (u - u₀)| and η >= |x_u(u) - x_u|:
//   ρ' <= μ ρ + ½ M (|x_u| δ + ρ)²        ρ(0) = ½ |c''| δ²
//   η' <= μ η + M (|x_u| δ + ρ)(|x_u| + η)   η(0) = |c''| δ
// where μ is the greatest eigenvalue of the symmetric part of Dv on the streamline, and M bounds D²v within the tube.
#pragma once

#include <vector>

#include "surfaces/stream/cells.hpp"
#include "surfaces/stream/mesh.hpp"

namespace smurf {

// Tells of every cell whether a tube proves where the true surface is, and how close to the patch.
void prove_cells(const VectorFieldDefinition& field, const SeedCurve& curve, const StreamCells& cells,
                 const std::vector<BezierPiece>& pieces, StreamMesh& mesh);

}  // namespace smurf
