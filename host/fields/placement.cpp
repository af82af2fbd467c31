#include "fields/placement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "smurf/error.hpp"

namespace smurf {

void require_placement(const GridPlacement& placement, std::string_view what) {
  const auto fail = [&](const std::string& message) {
    throw Error(ErrorCode::input, fmt::format("{}: {}", what, message));
  };
  const glm::dmat3& axes = placement.axes;
  glm::dmat3 unit;
  for (int a = 0; a < 3; a++) {
    const double greatest = std::max({std::abs(axes[a].x), std::abs(axes[a].y), std::abs(axes[a].z)});
    if (!std::isfinite(axes[a].x + axes[a].y + axes[a].z))
      fail(fmt::format("axis {} is ({}, {}, {}); it must be finite", a, axes[a].x, axes[a].y, axes[a].z));
    if (greatest == 0) fail(fmt::format("the step along axis {} is zero", a));
    unit[a] = glm::normalize(axes[a] / greatest);  // divided first, so that no square over- or underflows
  }
  const glm::dvec3& o = placement.origin;
  if (!std::isfinite(o.x + o.y + o.z)) fail(fmt::format("the origin ({}, {}, {}) is not finite", o.x, o.y, o.z));
  if (std::abs(glm::determinant(unit)) < 1e-10) fail("the axes are singular: they lie in one plane");
}

}  // namespace smurf
