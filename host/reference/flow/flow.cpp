#include "reference/flow/flow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/flow/extrapolation.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr int levels = 9;
// Of a piece's size: the first difference's step. The field of a cell is a polynomial or close to one; that of an
// expression has levels enough to come to a step that suits it.
constexpr double first_step = 0.25;

}  // namespace

ReferenceFlow::Value ReferenceFlow::at(const dvec3& point, double slack) const {
  Value found{find(point, slack), dvec3(std::numeric_limits<double>::quiet_NaN())};
  if (found.place.status != FlowStatus::inside) return found;
  const dvec3 v = value(found.place.piece, point, found.place.local);
  if (is_finite(v)) found.vector = v;
  else found.place.status = FlowStatus::undefined;
  return found;
}

glm::dmat3 ReferenceFlow::jacobian(const ReferencePlace& place, const dvec3& point) const {
  const auto near = [&](const dvec3& offset) {
    dvec3 local = place.local;
    return locate(place.piece, point + offset, local) ? value(place.piece, point + offset, local)
                                                      : dvec3(std::numeric_limits<double>::quiet_NaN());
  };
  glm::dmat3 result;
  for (int axis = 0; axis < 3; axis++) {
    dvec3 unit(0.0);
    unit[axis] = 1;
    result[axis] = extrapolated<levels>([&](int k) {
      const double h = std::ldexp(first_step * size(place.piece), -k);
      return (near(h * unit) - near(-h * unit)) / (2 * h);
    });
  }
  return result;
}

std::array<dvec3, 6> ReferenceFlow::hessian(const ReferencePlace& place, const dvec3& point) const {
  const auto near = [&](const dvec3& offset) {
    dvec3 local = place.local;
    return locate(place.piece, point + offset, local) ? value(place.piece, point + offset, local)
                                                      : dvec3(std::numeric_limits<double>::quiet_NaN());
  };
  const dvec3 middle = near(dvec3(0.0));
  const auto step = [&](int k) { return std::ldexp(first_step * size(place.piece), -k); };
  static constexpr std::array<std::array<int, 2>, 6> axes{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  std::array<dvec3, 6> result;
  for (std::size_t i = 0; i < 6; i++) {
    dvec3 a(0.0), b(0.0);
    a[axes[i][0]] = 1;
    b[axes[i][1]] = 1;
    result[i] = extrapolated<levels>([&](int k) {
      const double h = step(k);
      if (i < 3) return (near(h * a) - 2.0 * middle + near(-h * a)) / (h * h);
      return (near(h * (a + b)) - near(h * (a - b)) - near(h * (b - a)) + near(-h * (a + b))) / (4 * h * h);
    });
  }
  return result;
}

double extent_of(const ReferenceFlow& flow) {
  const dvec3 sides = flow.bounds().upper - flow.bounds().lower;
  return std::max({sides.x, sides.y, sides.z});
}

double slack_of(const ReferenceFlow& flow, const dvec3& point) {
  // Half a unit in the last place of a float for the point and as much for the border, twice for safety.
  return std::ldexp(std::max(greatest(point), 0.5 * extent_of(flow)), -22);
}

}  // namespace smurf
