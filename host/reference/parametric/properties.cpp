#include "reference/parametric/properties.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "smurf/interrogator.hpp"

namespace smurf {
namespace {

using glm::dmat3;
using glm::dvec2;
using glm::dvec3;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double singular_sine = 1e-9;  // of the angle between x_u and x_v

bool is_finite(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

struct NormalAndShape {
  dvec3 normal{0.0};
  dmat3 shape{0.0};  // the derivative of the normal along the surface
};

// Nothing where x_u and x_v span no plane. With the dual basis g^u, g^v of x_u and x_v the derivative of the normal is
// -(L g^u g^u + M (g^u g^v + g^v g^u) + N g^v g^v).
std::optional<NormalAndShape> shape_of(const ReferenceJet& p) {
  const dvec3 across = glm::cross(p.u, p.v);
  const double area = glm::length(across);
  if (!(area > singular_sine * glm::length(p.u) * glm::length(p.v)) || !std::isfinite(area)) return std::nullopt;
  NormalAndShape found;
  found.normal = across / area;
  const dvec3 gu = glm::cross(p.v, found.normal) / area, gv = glm::cross(found.normal, p.u) / area;
  const double l = glm::dot(p.uu, found.normal), m = glm::dot(p.uv, found.normal), n = glm::dot(p.vv, found.normal);
  found.shape = -(l * glm::outerProduct(gu, gu) + m * (glm::outerProduct(gu, gv) + glm::outerProduct(gv, gu)) +
                  n * glm::outerProduct(gv, gv));
  return found;
}

// The value at 0 of the polynomial through values at steps that are halved each time (Neville; Richardson).
template <class T, std::size_t Count>
T extrapolated(std::array<T, Count> values) {
  for (std::size_t level = 1; level < Count; level++) {
    const double factor = std::pow(2.0, double(level));
    for (std::size_t i = 0; i + level < Count; i++) values[i] = (factor * values[i + 1] - values[i]) / (factor - 1);
  }
  return values[0];
}

// The limit along a line of parameters, from places at `reach` · (1, 1/2, 1/4, ...) of it.
std::optional<NormalAndShape> limit_along(const ReferenceFacet& facet, const dvec2& at, const dvec2& reach) {
  constexpr std::size_t count = 7;
  std::array<dvec3, count> normals;
  std::array<dmat3, count> shapes;
  dvec2 step = reach;
  for (std::size_t i = 0; i < count; i++, step *= 0.5) {
    const dvec2 place = at + step;
    const auto found = shape_of(facet.at(place.x, place.y, 2));
    if (!found) return std::nullopt;
    normals[i] = found->normal;
    shapes[i] = found->shape;
  }
  NormalAndShape limit{extrapolated(normals), extrapolated(shapes)};
  const double length = glm::length(limit.normal);
  if (!(std::abs(length - 1) < 1e-4)) return std::nullopt;
  limit.normal /= length;
  return limit;
}

double size_of(const dmat3& m) { return std::sqrt(glm::dot(m[0], m[0]) + glm::dot(m[1], m[1]) + glm::dot(m[2], m[2])); }

// What limits from several directions have in common; the side that the first normal points to is taken.
SurfaceFrame common_limit(std::span<const std::optional<NormalAndShape>> limits, double extent) {
  constexpr double same_normal = 1e-5, same_shape = 1e-4;
  SurfaceFrame none = undefined_frame();
  none.status |= PointStatus::singular;
  if (limits.empty() || !limits[0]) return none;
  const NormalAndShape& first = *limits[0];
  dvec3 normal(0.0);
  dmat3 shape(0.0);
  double widest = 0;
  for (const auto& limit : limits) {
    if (!limit) return none;
    const double sign = glm::dot(limit->normal, first.normal) < 0 ? -1 : 1;
    if (!(glm::distance(sign * limit->normal, first.normal) < same_normal)) return none;
    normal += sign * limit->normal;
    shape += sign / double(limits.size()) * limit->shape;
    widest = std::max(widest, size_of(sign * limit->shape - first.shape));
    if (!std::isfinite(size_of(limit->shape))) widest = std::numeric_limits<double>::infinity();
  }
  normal = glm::normalize(normal);
  if (!(widest <= same_shape * (size_of(first.shape) + 1 / extent))) {
    none.normal = normal;
    return none;
  }
  // Directions agree to this, so that less of a difference is none.
  SurfaceFrame frame = level_set_frame(normal, shape, 1, std::max(widest, 1e-9 / extent));
  frame.normal = normal;
  frame.status |= PointStatus::singular;
  return frame;
}

}  // namespace

ReferenceProperties::ReferenceProperties(const std::vector<std::unique_ptr<ReferenceFacet>>& facets,
                                         const ReferenceCells& cells, const ReferenceBorders& borders, double extent)
    : facets_(facets), cells_(cells), borders_(borders), extent_(extent) {
  for (std::uint32_t i = 0; i < facets.size(); i++) {
    while (first_facet_.size() <= facets[i]->part) first_facet_.push_back(i);
  }
  first_facet_.push_back(std::uint32_t(facets.size()));
  for (const ReferencePole& pole : borders.poles()) limits_.push_back(limit(pole));
}

SurfaceFrame ReferenceProperties::regular(const ReferenceJet& jet) const {
  const auto found = shape_of(jet);
  if (!found) return undefined_frame();
  SurfaceFrame frame = level_set_frame(found->normal, found->shape, 1, 1e-12 / extent_);
  if ((frame.status & PointStatus::undefined) == 0) frame.normal = found->normal;
  return frame;
}

SurfaceFrame ReferenceProperties::limit(const ReferencePole& pole) const {
  constexpr int count = 8;
  std::vector<std::optional<NormalAndShape>> limits;
  for (const ReferenceSide& side : pole.sides) {
    const ReferenceFacet& facet = *facets_[side.facet];
    const int axis = side.side / 2;
    dvec2 reach(0.0);
    reach[axis] = (side.side % 2 == 0 ? 0.03 : -0.03) * (facet.upper[axis] - facet.lower[axis]);
    for (int i = 0; i < count; i++)
      limits.push_back(limit_along(facet, place_on_side(facet, side.side, (i + 0.37) / count), reach));
  }
  return common_limit(limits, extent_);
}

// Where x_u and x_v are parallel, but no side is collapsed.
SurfaceFrame ReferenceProperties::interior_limit(const ParametricPlace& place) const {
  const ReferenceFacet& facet = *facets_[place.facet];
  std::vector<std::optional<NormalAndShape>> limits;
  const dvec2 range = facet.upper - facet.lower, at(place.u, place.v);
  for (const double x : {-1.0, 0.13, 1.0}) {
    for (const double y : {-1.0, 0.17, 1.0}) {
      const dvec2 reach = 0.02 * range * dvec2(x, y), far = at + reach;
      const bool inside =
          glm::all(glm::greaterThanEqual(far, facet.lower)) && glm::all(glm::lessThanEqual(far, facet.upper));
      if (inside) limits.push_back(limit_along(facet, at, reach));
    }
  }
  return common_limit(limits, extent_);
}

bool ReferenceProperties::locate(std::uint32_t part, double u, double v, ParametricPlace& place) const {
  if (part + 1 >= first_facet_.size() || !std::isfinite(u) || !std::isfinite(v)) return false;
  const ReferenceFacet& any = *facets_[first_facet_[part]];
  dvec2 at(u, v);
  for (int axis = 0; axis < 2; axis++) {
    const double low = any.part_lower[axis], high = any.part_upper[axis];
    const double rounding = 2 * double(0x1p-23f) * std::max(std::abs(low), std::abs(high));
    if (at[axis] < low - rounding || at[axis] > high + rounding) return false;
    at[axis] = std::clamp(at[axis], low, high);
  }
  for (std::uint32_t i = first_facet_[part]; i < first_facet_[part + 1]; i++) {
    const ReferenceFacet& facet = *facets_[i];
    if (glm::any(glm::lessThan(at, facet.lower)) || glm::any(glm::greaterThan(at, facet.upper))) continue;
    place = {i, at.x, at.y};
    return true;
  }
  return false;
}

SurfaceFrame ReferenceProperties::measure(ParametricPlace& place) const {
  const ReferenceFacet& facet = *facets_[place.facet];
  for (int side = 0; side < 4; side++) {
    const std::uint32_t pole = borders_.side(place.facet, side).pole;
    if (pole == no_pole) continue;
    const int axis = side / 2;
    const double end = side % 2 == 0 ? facet.lower[axis] : facet.upper[axis];
    const double rounding =
        2 * double(0x1p-23f) * std::max(std::abs(facet.part_lower[axis]), std::abs(facet.part_upper[axis]));
    if (std::abs((axis == 0 ? place.u : place.v) - end) > rounding) continue;
    (axis == 0 ? place.u : place.v) = end;
    (axis == 0 ? place.v : place.u) = facet.part_lower[1 - axis];
    SurfaceFrame frame = limits_[pole];
    // The limit was taken for the side that the pole's first facet turns to it.
    const ReferenceSide& first = borders_.poles()[pole].sides[0];
    if (first.facet != place.facet) {
      dvec2 near = place_on_side(facet, side, 0.5), reach(0.0);
      near[axis] += (side % 2 == 0 ? 1e-3 : -1e-3) * (facet.upper[axis] - facet.lower[axis]);
      const ReferenceJet jet = facet.at(near.x, near.y, 1);
      if (glm::dot(glm::cross(jet.u, jet.v), frame.normal) < 0) {
        frame.normal = -frame.normal;
        std::swap(frame.k1, frame.k2);
        frame.k1 = -frame.k1;
        frame.k2 = -frame.k2;
        std::swap(frame.d1, frame.d2);
      }
    }
    return frame;
  }
  const ReferenceJet jet = facet.at(place.u, place.v, 2);
  if (!is_finite(jet.s)) return undefined_frame();
  const bool finite = is_finite(jet.u) && is_finite(jet.v);
  if (finite && !(glm::length(glm::cross(jet.u, jet.v)) > singular_sine * glm::length(jet.u) * glm::length(jet.v)))
    return interior_limit(place);
  return regular(jet);
}

bool ReferenceProperties::nearest(const dvec3& point, ParametricPlace& place) const {
  if (!is_finite(point)) return false;
  double best = std::numeric_limits<double>::infinity();
  const auto try_at = [&](std::uint32_t number, dvec2 at) {
    const ReferenceFacet& facet = *facets_[number];
    ReferenceJet p = facet.at(at.x, at.y, 2);
    double distance = glm::distance(p.s, point);
    if (!std::isfinite(distance)) return;
    // Newton's method on the squared distance, within the facet; where that is no way down, along the surface alone.
    for (int step = 0; step < 60; step++) {
      const dvec3 away = p.s - point;
      dvec2 slope(glm::dot(p.u, away), glm::dot(p.v, away));
      std::array<bool, 2> fixed{};
      for (int axis = 0; axis < 2; axis++) {
        fixed[std::size_t(axis)] =
            (at[axis] <= facet.lower[axis] && slope[axis] > 0) || (at[axis] >= facet.upper[axis] && slope[axis] < 0);
      }
      const double first_uu = glm::dot(p.u, p.u), first_uv = glm::dot(p.u, p.v), first_vv = glm::dot(p.v, p.v);
      const auto move_by = [&](double uu, double uv, double vv) {
        if (fixed[0] && fixed[1]) return dvec2(0.0);
        if (fixed[0]) return dvec2(0, vv > 0 ? -slope.y / vv : 0);
        if (fixed[1]) return dvec2(uu > 0 ? -slope.x / uu : 0, 0);
        const double determinant = uu * vv - uv * uv;
        if (!(determinant > 1e-14 * uu * vv) || !(uu > 0))
          return dvec2(first_uu > 0 ? -slope.x / (2 * first_uu) : 0, first_vv > 0 ? -slope.y / (2 * first_vv) : 0);
        return dvec2(uv * slope.y - vv * slope.x, uv * slope.x - uu * slope.y) / determinant;
      };
      const dvec2 whole =
          move_by(first_uu + glm::dot(p.uu, away), first_uv + glm::dot(p.uv, away), first_vv + glm::dot(p.vv, away));
      const dvec2 along = move_by(first_uu, first_uv, first_vv);
      bool better = false;
      for (const dvec2& move : {whole, along}) {
        for (double part = 1; part > 1e-3 && !better; part *= 0.35) {
          const dvec2 next = glm::clamp(at + part * move, facet.lower, facet.upper);
          if (next == at) continue;
          const ReferenceJet there = facet.at(next.x, next.y, 2);
          const double d = glm::distance(there.s, point);
          // Near the foot rounding of the distance hides what the last steps win.
          const bool last = part == 1 && d <= distance * (1 + 1e-15) &&
                            glm::all(glm::lessThan(glm::abs(next - at), 1e-7 * facet.range()));
          if (!(d < distance) && !last) continue;
          better =
              glm::any(glm::greaterThan(glm::abs(next - at), 1e-16 * facet.range())) && (d < distance || step < 50);
          at = next;
          p = there;
          distance = std::min(d, distance);
          if (!better) step = 60;
          break;
        }
        if (better) break;
      }
      if (!better) break;
    }
    if (distance < best * (1 - 1e-12) || !std::isfinite(best)) {
      best = distance;
      place = {number, at.x, at.y};
    }
  };
  cells_.around(point, best, [&](const ReferenceCell& cell) {
    // From its best corner or its middle.
    const ReferenceFacet& facet = *facets_[cell.facet];
    dvec2 from = cell.middle();
    double least = std::numeric_limits<double>::infinity();
    for (const dvec2& at : {cell.middle(), cell.lower, cell.upper, dvec2(cell.lower.x, cell.upper.y),
                            dvec2(cell.upper.x, cell.lower.y)}) {
      const double distance = glm::distance(facet.at(at.x, at.y, 0).s, point);
      if (distance < least) {
        least = distance;
        from = at;
      }
    }
    try_at(cell.facet, from);
    // At a pole the distance may have no slope within the facet, though there are nearer points.
    if (place.facet == cell.facet && dvec2(place.u, place.v) == from) try_at(cell.facet, cell.middle());
    return best;
  });
  return std::isfinite(best);
}

}  // namespace smurf
