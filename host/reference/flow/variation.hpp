// Derivatives of streamlines by the parameter of their seeds, as differences of streamlines.
//
// Not by the variational equations that devices integrate: lines from the seeds c(±ε) = p ± ε t + ε²/2 s, central
// differences of first and second order in ε, extrapolated to ε = 0.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "reference/flow/line.hpp"

namespace smurf {

struct LineVariation {
  std::vector<glm::dvec3> first, second;  // at the line's points; NaN where neighbours end before
};

// `order` 1: first derivatives only. Tangents may be 0.
LineVariation vary_line(const ReferenceFlow& flow, const ReferenceLine& line, const LineRequest& request,
                        const glm::dvec3& tangent, const glm::dvec3& second_tangent, int order);

}  // namespace smurf
