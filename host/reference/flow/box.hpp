// Fields that are one smooth piece, a box or what lies of it in a ball: expressions and functions.
#pragma once

#include <algorithm>

#include "reference/flow/extrapolation.hpp"
#include "reference/flow/flow.hpp"

namespace smurf {

class BoxFlow : public ReferenceFlow {
 public:
  explicit BoxFlow(const Domain& domain)
      : bounds_{domain.lower, domain.upper}, radius_(domain.radius > 0 ? domain.radius : no_ball) {}

  Bounds bounds() const final { return bounds_; }
  bool has_cells() const final { return false; }
  double radius() const final { return radius_; }

  ReferencePlace find(const glm::dvec3& point, double slack) const final {
    ReferencePlace place;
    if (!is_finite(point)) return place;
    for (int axis = 0; axis < 3; axis++)
      if (point[axis] < bounds_.lower[axis] - slack || point[axis] > bounds_.upper[axis] + slack) return place;
    if (glm::length(point) > radius_ + slack) return place;
    place.piece = 0;
    locate(0, point, place.local);
    place.status = is_finite(value(0, point, place.local)) ? FlowStatus::inside : FlowStatus::undefined;
    return place;
  }

  bool locate(std::int32_t, const glm::dvec3& point, glm::dvec3& local) const final {
    local = (point - bounds_.lower) / (bounds_.upper - bounds_.lower);
    return true;
  }

  double size(std::int32_t) const final {
    const glm::dvec3 sides = bounds_.upper - bounds_.lower;
    return std::min({sides.x, sides.y, sides.z}) / 8;
  }

 private:
  Bounds bounds_;
  double radius_;
};

}  // namespace smurf
