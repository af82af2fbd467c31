#include "reference/parametric/search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace smurf {
namespace {

using glm::dmat2;
using glm::dvec2;
using glm::dvec3;

constexpr int deepest = 8;        // halvings of cells that the surface may run along the line in
constexpr double inside = 1e-12;  // of the range, by which a root may lie outside

bool is_finite(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }
bool is_finite(const dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); }
double turn(const dvec2& a, const dvec2& b) { return a.x * b.y - a.y * b.x; }

// x with x.x·a + x.y·b = f; of least length, where a and b are parallel to rounding.
dvec2 solve(const dvec2& a, const dvec2& b, const dvec2& f) {
  const double determinant = turn(a, b), aa = glm::dot(a, a), bb = glm::dot(b, b);
  if (std::abs(determinant) > 1e-14 * std::sqrt(aa * bb)) return {turn(f, b) / determinant, turn(a, f) / determinant};
  const double all = aa + bb;
  if (!(all > 0)) return dvec2(0.0);
  return {glm::dot(a, f) / all, glm::dot(b, f) / all};
}

// Coordinates of the part of p along the surface.
dvec2 tangent_coordinates(const ReferenceJet& jet, const dvec3& p) {
  const double uu = glm::dot(jet.u, jet.u), uv = glm::dot(jet.u, jet.v), vv = glm::dot(jet.v, jet.v);
  return solve({uu, uv}, {uv, vv}, {glm::dot(jet.u, p), glm::dot(jet.v, p)});
}

}  // namespace

LineSearch::LineSearch(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ReferenceBorders& borders,
                       double extent, const dvec3& origin, const dvec3& direction, double low, double high,
                       double rounding)
    : facets_(facets),
      borders_(borders),
      extent_(extent),
      origin_(origin),
      direction_(direction),
      low_(low),
      high_(high),
      tolerance_(1e-13 * extent + rounding),
      noise_(2e-15 * extent + rounding) {
  const dvec3 axis = std::abs(direction.x) < 0.6 ? dvec3(1, 0, 0) : dvec3(0, 1, 0);
  e1_ = glm::normalize(glm::cross(direction, axis));
  e2_ = glm::cross(direction, e1_);
}

// Whether the line surely passes by the cell, as far as its bounds are to be believed.
bool LineSearch::passes(const ReferenceCell& cell) const {
  const dvec3 to_centre = cell.centre - origin_;
  const double middle = glm::dot(to_centre, direction_);
  const dvec2 aside = across(to_centre);
  const double square = cell.radius * cell.radius - glm::dot(aside, aside);
  if (square < 0) return true;
  const double half = std::sqrt(square);
  if (middle + half < low_ || middle - half > high_) return true;
  if (cell.normal == dvec3(0.0)) return false;
  const double height = glm::dot(cell.normal, middle * direction_ - to_centre);
  const double rise = half * std::abs(glm::dot(cell.normal, direction_));
  return std::abs(height) - rise > cell.thickness;
}

bool LineSearch::within_stretch(const ReferenceCell& cell) const {
  const double middle = glm::dot(cell.centre - origin_, direction_);
  return std::ranges::any_of(roots_, [&](const LineRoot& r) {
    return r.facet == cell.facet && r.high - r.low > cell.radius && r.low - cell.radius <= middle &&
           middle <= r.high + cell.radius;
  });
}

bool LineSearch::in_domain(std::uint32_t facet, const dvec2& at, const ReferenceJet& jet) const {
  const ReferenceFacet& f = *facets_[facet];
  const dvec2 range = f.range();
  for (int axis = 0; axis < 2; axis++) {
    const double outside = std::max(f.lower[axis] - at[axis], at[axis] - f.upper[axis]);
    if (outside <= inside * range[axis]) continue;
    const int side = 2 * axis + (at[axis] > f.upper[axis] ? 1 : 0);
    const double distance = outside * glm::length(axis == 0 ? jet.u : jet.v);
    if (!(distance <= 2 * borders_.side(facet, side).gap)) return false;
  }
  return true;
}

void LineSearch::take(std::uint32_t facet, const dvec2& at, const ReferenceJet& jet) {
  if (!in_domain(facet, at, jet)) return;
  const dvec3 normal = glm::cross(jet.u, jet.v);
  const double length = glm::length(normal);
  const double t = glm::dot(jet.s - origin_, direction_),
               slope = length > 0 ? glm::dot(normal, direction_) / length : 0;
  // Two roots that are so near to each other that nothing lies between them, or more.
  const bool touches = slope * slope <= 4 * tolerance_ / extent_;
  if (touches && length > 1e-9 * glm::length(jet.u) * glm::length(jet.v)) {
    take_contact(facet, at, t);
    return;
  }
  // Where steps did not come as near as that, the place is off by what is left.
  const double left = std::max(16 * noise_, 2 * glm::length(across(jet.s - origin_)));
  const double reach = left / std::max(std::abs(slope), 1e-7);
  roots_.push_back(
      {facet, at.x, at.y, t, t, t, jet.s, slope, reach, reach / dvec2(glm::length(jet.u), glm::length(jet.v))});
}

// Of thin cells steps are measured by their length, too: how the surface bends along it moves places across it by a
// part of that.
LineSearch::Start LineSearch::start_in(const ReferenceCell& cell, const dvec2& at) const {
  constexpr double thinnest = 0.5;
  const ReferenceFacet& f = *facets_[cell.facet];
  const ReferenceJet jet = f.at(cell.middle().x, cell.middle().y, 1);
  const dvec2 size = cell.upper - cell.lower, speed(glm::length(jet.u), glm::length(jet.v));
  Start start{at, size};
  for (int axis = 0; axis < 2; axis++) {
    const double wide = thinnest * size[1 - axis] * speed[1 - axis] / speed[axis];
    if (wide > size[axis]) start.size[axis] = std::min(wide, std::max(size[axis], f.range()[axis]));
  }
  for (int side = 0; side < 4; side++) {
    const int axis = side / 2;
    const bool there = side % 2 == 0 ? cell.lower[axis] == f.lower[axis] : cell.upper[axis] == f.upper[axis];
    if (there && borders_.side(cell.facet, side).pole != no_pole) start.pole = side;
  }
  return start;
}

// Where a step leads that is taken within the surface. Around a pole parameters are polar coordinates: on a straight
// way that passes by it the one around it turns, by as much as half a turn, which steps of parameters do not follow.
dvec2 LineSearch::around_pole(std::uint32_t facet, const Start& start, const dvec2& at, const ReferenceJet& jet,
                              dvec2 move) const {
  const ReferenceFacet& f = *facets_[facet];
  const int out = start.pole / 2, around = 1 - out;
  const double end = start.pole % 2 == 0 ? f.lower[out] : f.upper[out], inwards = start.pole % 2 == 0 ? 1 : -1;
  const double radius = inwards * (at[out] - end);
  // With p = radius·c(a), c'' = -turning²·c, but for the part along c'.
  const double bend = tangent_coordinates(jet, around == 0 ? jet.uu : jet.vv)[out] * inwards;
  const double turning = std::sqrt(-bend / radius);
  if (!(radius > 0) || !(turning > 0) || !std::isfinite(turning)) return at + move;
  double along = inwards * move[out], across = radius * turning * move[around];
  const double most = std::hypot(along, across) / start.size[out];
  if (most > 1) along /= most, across /= most;
  dvec2 next = at;
  next[out] = end + inwards * std::hypot(radius + along, across);
  next[around] += std::atan2(across, radius + along) / turning;
  return next;
}

// Whether roots are found from places ever nearer to the pole, as far as the line passes by it: from farther off the
// bend of the surface may lead to another sector, or to the root behind the fold.
bool LineSearch::look_towards_pole(const ReferenceCell& cell, const Start& start) {
  constexpr double nearer = 1.0 / 32;
  const ReferenceFacet& f = *facets_[cell.facet];
  const int out = start.pole / 2;
  const double end = start.pole % 2 == 0 ? f.lower[out] : f.upper[out];
  dvec2 pole = start.at;
  pole[out] = end;
  const ReferenceJet jet = f.at(pole.x, pole.y, 1);
  const double aside = glm::length(across(jet.s - origin_)) / glm::length(out == 0 ? jet.u : jet.v);
  const std::size_t before = roots_.size();
  Start next = start;
  for (int i = 0; i < 8; i++) {
    iterate(cell.facet, next);
    if (!(std::abs(next.at[out] - end) > aside)) break;
    next.at[out] = end + nearer * (next.at[out] - end);
  }
  return roots_.size() > before;
}

// The same place within the range, where the facet is closed around a pole.
dvec2 LineSearch::within_turn(std::uint32_t facet, int axis, const dvec2& at) const {
  const ReferenceFacet& f = *facets_[facet];
  dvec2 other = at;
  other[axis] -= f.range()[axis] * std::floor((at[axis] - f.lower[axis]) / f.range()[axis]);
  if (other[axis] == at[axis]) return at;
  const double apart = glm::distance(f.at(at.x, at.y, 0).s, f.at(other.x, other.y, 0).s);
  return apart <= tolerance_ ? other : at;
}

// Newton's iteration; steps are cut to the cell's size.
LineSearch::Outcome LineSearch::iterate(std::uint32_t facet, const Start& start) {
  const ReferenceFacet& f = *facets_[facet];
  dvec2 at = start.at;
  for (int step = 0; step < 60; step++) {
    ReferenceJet jet = f.at(at.x, at.y, start.pole < 0 ? 1 : 2);
    if (!is_finite(jet.s) || !is_finite(jet.u) || !is_finite(jet.v)) return Outcome::none;
    const dvec2 off = across(jet.s - origin_);
    dvec2 move = -solve(across(jet.u), across(jet.v), off);
    if (!is_finite(move)) return Outcome::none;
    const double most = std::max(std::abs(move.x) / start.size.x, std::abs(move.y) / start.size.y);
    if (glm::length(off) <= tolerance_) {
      // More steps, of which the best is kept. Around a pole short ones may turn far, and lead away at first.
      const bool near = most < 1e-2 || glm::length(move.x * jet.u + move.y * jet.v) < 1e-6 * extent_;
      double least = glm::length(off);
      dvec2 better = at;
      for (int more = 0; more < 8 && near; more++) {
        better += move;
        const ReferenceJet again = f.at(better.x, better.y, 1);
        const dvec2 still_off = across(again.s - origin_);
        move = -solve(across(again.u), across(again.v), still_off);
        const double left = glm::length(still_off);
        if (!(left < 100 * tolerance_) || !is_finite(move)) break;
        if (!(left < least)) {
          if (least <= noise_) break;
          continue;
        }
        least = left;
        at = better;
        jet = again;
      }
      if (start.pole >= 0) at = within_turn(facet, start.pole < 2 ? 1 : 0, at);
      take(facet, at, jet);
      return Outcome::root;
    }
    const dvec2 cut = most > 1 ? move / most : move;
    at = start.pole < 0 ? at + cut : around_pole(facet, start, at, jet, move);
    dvec2 away = glm::abs(at - start.at) / start.size;
    // Once around a pole, and a half, whichever of its sectors it is started in.
    const int around = start.pole < 2 ? 1 : 0;
    if (start.pole >= 0) away[around] = std::abs(at[around] - start.at[around]) / (0.5 * f.range()[around]);
    if (away.x > 3 || away.y > 3) return Outcome::left;
  }
  return Outcome::none;
}

void LineSearch::look_into(const ReferenceCell& cell, bool flat) {
  // A flat facet that the line runs along is not hit by it.
  if (flat && std::abs(glm::dot(cell.normal, direction_)) < 1e-12) return;
  look(cell, 0);
}

void LineSearch::look(const ReferenceCell& cell, int depth) {
  if (cell.defined == 0 || passes(cell)) return;
  const bool crossed =
      cell.spread < 1 && std::abs(glm::dot(cell.normal, direction_)) > std::sin(std::min(cell.spread, 1.5)) + 1e-3;
  if (crossed) {
    const ReferenceJet jet = facets_[cell.facet]->at(cell.middle().x, cell.middle().y, 1);
    const dvec2 move = -solve(across(jet.u), across(jet.v), across(jet.s - origin_));
    Start start = start_in(cell, cell.middle());
    if (start.pole >= 0) {
      if (look_towards_pole(cell, start)) return;
      start.pole = -1;
    }
    // So far away there is another cell to find it from.
    if (std::abs(move.x) > 1.5 * start.size.x || std::abs(move.y) > 1.5 * start.size.y) return;
    if (iterate(cell.facet, start) == Outcome::root) return;
  }
  if (depth < (crossed ? 2 : deepest)) {
    if (!crossed && within_stretch(cell)) return;
    const dvec2 middle = cell.middle();
    const ReferenceFacet& facet = *facets_[cell.facet];
    // Thin cells, as next to poles, are halved along their length.
    const bool halve_u = !(4 * cell.length.x < cell.length.y), halve_v = !(4 * cell.length.y < cell.length.x);
    for (const bool up : {false, true}) {
      for (const bool right : {false, true}) {
        if ((up && !halve_v) || (right && !halve_u)) continue;
        dvec2 lower = cell.lower, upper = cell.upper;
        if (halve_u) (right ? lower : upper).x = middle.x;
        if (halve_v) (up ? lower : upper).y = middle.y;
        look(reference_cell(facet, cell.facet, lower, upper), depth + 1);
      }
    }
    return;
  }
  if (!crossed) look_along(cell);
}

// A small cell that the line runs along: finds the fold next to it, where the normal is at right angles to the line and
// the surface right above or below it. The distance there tells of none, two, or an undecided number of roots.
void LineSearch::look_along(const ReferenceCell& cell) {
  if (within_stretch(cell)) return;
  const ReferenceFacet& f = *facets_[cell.facet];
  const dvec2 size = cell.upper - cell.lower;
  dvec2 at = cell.middle();
  bool found = false;
  for (int step = 0; step < 20 && !found; step++) {
    const ReferenceJet p = f.at(at.x, at.y, 2);
    const dvec3 normal = glm::cross(p.u, p.v), away = p.s - origin_, beside = glm::cross(direction_, normal);
    const dvec3 normal_u = glm::cross(p.uu, p.v) + glm::cross(p.u, p.uv);
    const dvec3 normal_v = glm::cross(p.uv, p.v) + glm::cross(p.u, p.vv);
    const dvec2 off(glm::dot(normal, direction_), glm::dot(away, beside));
    const dvec2 by_u(glm::dot(normal_u, direction_),
                     glm::dot(p.u, beside) + glm::dot(away, glm::cross(direction_, normal_u)));
    const dvec2 by_v(glm::dot(normal_v, direction_),
                     glm::dot(p.v, beside) + glm::dot(away, glm::cross(direction_, normal_v)));
    const dvec2 move = -solve(by_u, by_v, off);
    if (!is_finite(move)) break;
    const dvec2 relative = glm::abs(move) / size;
    const double most = std::max(relative.x, relative.y);
    found = most < 1e-9;
    at += most > 1 ? move / most : move;
    const dvec2 gone = glm::abs(at - cell.middle()) / size;
    if (gone.x > 2 || gone.y > 2) break;
  }
  if (found) {
    const ReferenceJet p = f.at(at.x, at.y, 2);
    const dvec3 normal = glm::normalize(glm::cross(p.u, p.v));
    const double distance = glm::dot(p.s - origin_, normal), t = glm::dot(p.s - origin_, direction_);
    const dvec2 along = tangent_coordinates(p, direction_);
    const double bend =
        glm::dot(p.uu * along.x * along.x + 2.0 * p.uv * along.x * along.y + p.vv * along.y * along.y, normal);
    // At creases the iteration may stop where there is no fold.
    const bool is_fold = std::abs(glm::dot(normal, direction_)) < 1e-6;
    if (is_fold && std::abs(distance) <= tolerance_ && in_domain(cell.facet, at, p)) {
      take_contact(cell.facet, at, t);
      return;
    } else if (is_fold && distance * bend < 0) {
      const double step = std::sqrt(-2 * distance / bend);
      const dvec2 moved = step * along;
      // Newton's iteration from either side of a fold leads to the root on that side.
      if (std::abs(moved.x) < 3 * size.x && std::abs(moved.y) < 3 * size.y) {
        const dvec2 near = glm::max(2.0 * glm::abs(moved), 1e-6 * size);
        iterate(cell.facet, {at + 1.2 * moved, near});
        iterate(cell.facet, {at - 1.2 * moved, near});
      }
    }
  }
  for (const dvec2& start :
       {cell.middle(), cell.lower, cell.upper, dvec2(cell.lower.x, cell.upper.y), dvec2(cell.upper.x, cell.lower.y)})
    iterate(cell.facet, start_in(cell, start));
  const Start start = start_in(cell, cell.middle());
  if (start.pole >= 0) look_towards_pole(cell, start);
}

// The parameters next to `from` of the point of the surface next to the line's point at t, if that is on the surface.
std::optional<dvec2> LineSearch::project(std::uint32_t facet, const dvec2& from, double t) const {
  const ReferenceFacet& f = *facets_[facet];
  const dvec3 target = origin_ + t * direction_;
  dvec2 at = from;
  for (int step = 0; step < 20; step++) {
    const ReferenceJet p = f.at(at.x, at.y, 1);
    if (!is_finite(p.s)) return std::nullopt;
    if (glm::distance(p.s, target) <= 4 * tolerance_) {
      if (!in_domain(facet, at, p)) return std::nullopt;
      return at;
    }
    const dvec2 move = tangent_coordinates(p, target - p.s);
    if (!is_finite(move)) return std::nullopt;
    at += move;
  }
  return std::nullopt;
}

// How far from t the line stays within the surface.
double LineSearch::follow(std::uint32_t facet, dvec2 at, double t, double step) const {
  double end = t;
  // No line lies within the surface for longer than the surface is; but rounding may, of rays from very far away.
  while (std::abs(step) > 1e-12 * extent_ && std::abs(end - t) < 2 * extent_) {
    const auto next = project(facet, at, end + step);
    if (next && end + step >= low_ - extent_ && end + step <= high_ + extent_) {
      at = *next;
      end += step;
    } else {
      step *= 0.5;
    }
  }
  return end;
}

void LineSearch::take_contact(std::uint32_t facet, const dvec2& at, double t) {
  const bool known = std::ranges::any_of(roots_, [&](const LineRoot& r) {
    return r.facet == facet && !r.is_single() && r.low <= t && t <= r.high &&
           glm::distance(r.place, origin_ + t * direction_) <= r.high - r.low;
  });
  if (known) return;
  const double step = extent_ / 64;
  const double begin = follow(facet, at, t, -step), end = follow(facet, at, t, step);
  const bool is_long = end - begin > longest_contact * extent_;
  const double middle = is_long ? 0.5 * (begin + end) : t;
  const dvec2 there = is_long ? project(facet, at, middle).value_or(at) : at;
  // Where it cannot be followed there are still the points that count as the root.
  const double least = std::sqrt(tolerance_ * extent_) * (end - begin < 1e-9 * extent_ ? 1 : 0);
  roots_.push_back({.facet = facet,
                    .u = there.x,
                    .v = there.y,
                    .t = middle,
                    .low = begin - least,
                    .high = end + least,
                    .place = origin_ + middle * direction_});
}

}  // namespace smurf
