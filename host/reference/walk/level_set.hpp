// Section curves of level sets, followed with nothing but values of the function.
//
// In the plane of a section the curve is g(x, y) = 0. From a point of it, the next one is where g changes its sign on
// a small circle around the point, ahead: samples on an arc of 120° tell where, and Brent's method finds it. So every
// point is on the curve to rounding. A step is halved where there is not one such place, on the right side, or where
// the curve turns by more than a few degrees, at the step's end or at its middle. Where it does so however short the
// step is, there is a crease, and the whole circle is looked at. No derivative is used.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <optional>

#include "reference/walk/section.hpp"

namespace smurf {

// f - level; nothing outside of the domain, NaN where the function is undefined. `scale` is a length over which the
// function is smooth.
struct LevelSet {
  std::function<std::optional<double>(const glm::dvec3&)> value;
  double scale = 0;
};

SectionEnd follow_section(const LevelSet& surface, const SectionStart& start);

// The point of the level set nearest to p on the line p + y·direction, |y| at most `reach`; nothing where there is none.
std::optional<glm::dvec3> level_set_along(const LevelSet& surface, const glm::dvec3& p, const glm::dvec3& direction,
                                          double reach);

// Walks on a level set whose normals `frames` tells (ReferenceSurface::measure).
ReferenceWalker begin_walk(const LevelSet& surface, const ReferenceSurface& frames, const glm::dvec3& point,
                           const glm::dvec3& direction, double tolerance);
ReferenceWalker step_of_walk(const LevelSet& surface, const ReferenceSurface& frames, const ReferenceWalker& from,
                             double distance);

}  // namespace smurf
