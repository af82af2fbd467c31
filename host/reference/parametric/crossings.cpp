#include "reference/parametric/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include "reference/parametric/search.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double same_parameter = 1e-9;  // of the range
constexpr double same_place = 1e-9;      // of the extent

bool is_flat(const ReferenceFacet& facet, double extent) {
  constexpr int count = 8;
  dvec3 normal(0.0), first(0.0);
  for (int j = 0; j <= count; j++) {
    for (int i = 0; i <= count; i++) {
      const dvec2 at = facet.lower + dvec2(i, j) / double(count) * (facet.upper - facet.lower);
      const ReferenceJet p = facet.at(at.x, at.y, 1);
      if (normal == dvec3(0.0)) {
        const dvec3 n = glm::cross(p.u, p.v);
        if (glm::length(n) > 1e-6 * glm::length(p.u) * glm::length(p.v)) normal = glm::normalize(n);
        first = p.s;
      }
      if (!(std::abs(glm::dot(normal, p.s - first)) <= 1e-13 * extent)) return false;
    }
  }
  return normal != dvec3(0.0);
}

bool is_stretch(const LineRoot& root, double extent) { return root.high - root.low > longest_contact * extent; }

// Joins what is one root: found from two cells or from both sides of a knot, or within what another stands for.
std::vector<LineRoot> distinct(std::vector<LineRoot> roots, const std::vector<std::unique_ptr<ReferenceFacet>>& facets,
                               double extent) {
  // What stands for more comes first.
  std::ranges::stable_sort(roots, std::greater<>(), [](const LineRoot& r) { return r.high - r.low; });
  std::vector<LineRoot> kept;
  for (const LineRoot& root : roots) {
    const ReferenceFacet& facet = *facets[root.facet];
    const dvec2 range = facet.range();
    const bool known = std::ranges::any_of(kept, [&](LineRoot& other) {
      if (facets[other.facet]->part != facet.part) return false;
      const double reach = other.high - other.low, near = same_place * extent + reach;
      if (is_stretch(other, extent)) {
        // Facets side by side see parts of one stretch.
        const double touching = same_place * extent;
        const bool beside = root.low <= other.high + touching && root.high >= other.low - touching;
        if (!beside || (root.is_single() && std::abs(root.slope) > 1e-5)) return false;
        other.low = std::min(other.low, root.low);
        other.high = std::max(other.high, root.high);
        return true;
      }
      if (!other.is_single()) {
        const double touching = same_place * extent;
        if (root.low > other.high + touching || root.high < other.low - touching ||
            glm::distance(root.place, other.place) > near + root.high - root.low)
          return false;
        other.low = std::min(other.low, root.low);
        other.high = std::max(other.high, root.high);
        return true;
      }
      if (!(glm::distance(root.place, other.place) <= near + root.rounding + other.rounding)) return false;
      // Next to a pole rounding leaves little of the coordinate around it, and places are all there is to compare.
      const dvec2 rounding = root.parameter_rounding + other.parameter_rounding;
      if (rounding.x > 1e-5 * range.x || rounding.y > 1e-5 * range.y) return root.slope * other.slope >= 0;
      // Across a seam, too, where rounding may have moved one of them over it.
      const dvec2 apart = glm::abs(dvec2(root.u - other.u, root.v - other.v));
      for (int axis = 0; axis < 2; axis++) {
        const double same = same_parameter * range[axis];
        const bool moved = rounding[axis] > same && range[axis] - apart[axis] <= rounding[axis];
        if (apart[axis] > same + rounding[axis] && !moved) return false;
      }
      return true;
    });
    if (!known) kept.push_back(root);
  }
  return kept;
}

}  // namespace

// A root on a border, with what is needed to see who meets there.
struct ReferenceCrossings::OnBorder {
  std::size_t root = 0;
  double gap = 0;
  std::vector<dvec3> fan{};
  bool grouped = false;
};

ReferenceCrossings::ReferenceCrossings(const std::vector<std::unique_ptr<ReferenceFacet>>& facets,
                                       const ReferenceCells& cells, const ReferenceBorders& borders, double extent)
    : facets_(facets), cells_(cells), borders_(borders), extent_(extent) {
  for (const auto& facet : facets) flat_.push_back(is_flat(*facet, extent));
}

std::optional<ReferenceCrossings::OnBorder> ReferenceCrossings::on_border(const LineRoot& root) const {
  const ReferenceFacet& facet = *facets_[root.facet];
  const ReferenceJet jet = facet.at(root.u, root.v, 1);
  const dvec2 range = facet.range();
  OnBorder found;
  std::vector<int> sides;
  for (int side = 0; side < 4; side++) {
    if (!facet.border[std::size_t(side)]) continue;
    const int axis = side / 2;
    const double away =
        std::abs((axis == 0 ? root.u : root.v) - (side % 2 == 0 ? facet.lower[axis] : facet.upper[axis]));
    const double gap = borders_.side(root.facet, side).gap, speed = glm::length(axis == 0 ? jet.u : jet.v);
    if (away > same_parameter * range[axis] && !(away * speed <= 4 * gap)) continue;
    sides.push_back(side);
    found.gap = std::max(found.gap, gap);
  }
  if (sides.empty()) return std::nullopt;
  const dvec3 in = inwards(jet, sides[0]), along = sides[0] < 2 ? jet.v : jet.u;
  // Of opposite sides, which are as near where a facet is no wider than a gap, the first does.
  const bool corner = sides.size() > 1 && sides.back() / 2 != sides[0] / 2;
  found.fan = corner ? std::vector{in, inwards(jet, sides.back())} : std::vector{along, in, -along};
  return found;
}

std::vector<ParametricCrossing> ReferenceCrossings::find(const dvec3& origin, const dvec3& direction, double low,
                                                         double high) const {
  const double length = std::hypot(direction.x, direction.y, direction.z);
  const dvec3 d = direction / length;
  // From the point next to the surface, so that a far origin costs no digits but those of the ray itself.
  const double shift = glm::dot(0.5 * (cells_.lower() + cells_.upper()) - origin, d);
  const dvec3 start = origin + shift * d;
  const double near = low * length - shift, far = high * length - shift;
  const double rounding = 4e-16 * (glm::length(origin) + std::abs(shift)), margin = 1e-9 * extent_ + 8 * rounding;
  LineSearch search(facets_, borders_, extent_, start, d, near - margin, far + margin, rounding);
  cells_.along(start, d, near - margin, far + margin,
               [&](const ReferenceCell& cell) { search.look_into(cell, flat_[cell.facet]); });
  const std::vector<LineRoot> roots = distinct(std::move(search.roots()), facets_, extent_);

  std::vector<ParametricCrossing> crossings;
  const auto add = [&](const LineRoot& root) {
    const double tolerance = search.tolerance(), slope = std::abs(root.slope);
    // By rounding, or within a gap, a root may lie a little outside.
    const ReferenceFacet& facet = *facets_[root.facet];
    const dvec2 at = glm::clamp(dvec2(root.u, root.v), facet.part_lower, facet.part_upper);
    ParametricCrossing c{.facet = root.facet, .u = at.x, .v = at.y, .t = root.t, .place = root.place};
    c.slope = root.slope;
    if (root.is_single()) {
      c.uncertainty = tolerance / slope;
    } else {
      c.t = 0.5 * (std::max(root.low, near) + std::min(root.high, far));
      c.uncertainty = 0.5 * (std::min(root.high, far) - std::max(root.low, near));
      c.status = is_stretch(root, extent_) ? HitStatus::unresolved : HitStatus::tangent;
      if (c.uncertainty < 0) return;
    }
    if (c.t < near - 8 * tolerance || c.t > far + 8 * tolerance) return;
    crossings.push_back(c);
  };

  std::vector<bool> at_pole(roots.size());
  for (std::uint32_t i = 0; i < borders_.poles().size(); i++) {
    const ReferencePole& pole = borders_.poles()[i];
    const double t = glm::dot(pole.position - start, d), aside = glm::distance(pole.position, start + t * d);
    // Farther than roots may lie outside of the range, where the surface goes on beyond the pole.
    const double reach = 1e-11 * extent_ + 8 * rounding + pole.radius;
    if (aside > reach || t < near - reach || t > far + reach) continue;
    std::optional<LineRoot> contact;
    for (std::size_t k = 0; k < roots.size(); k++) {
      const LineRoot& root = roots[k];
      // A line that grazes is next to the pole for longer; but not as far as to its other root there.
      const double slope = std::abs(root.slope);
      const double along = slope > 0 ? std::min(2 * reach / slope, 0.1 * slope * extent_) : 0;
      const double near = 2 * reach + along + same_place * extent_ + (root.high - root.low);
      if (glm::distance(root.place, pole.position) > near) continue;
      if (root.is_single()) {
        at_pole[k] = true;
        continue;
      }
      // A contact that the pole is within stands for it, and for those of the other facets there.
      if (t < root.low - reach || t > root.high + reach) continue;
      at_pole[k] = true;
      if (!contact) contact = root;
      contact->low = std::min(contact->low, root.low);
      contact->high = std::max(contact->high, root.high);
    }
    std::vector<ParametricCrossing> found = at(pole, i, d);
    if (contact) {
      if (!is_stretch(*contact, extent_)) {
        contact->facet = found.front().facet;
        contact->u = found.front().u;
        contact->v = found.front().v;
      }
      add(*contact);
      continue;
    }
    for (ParametricCrossing& c : found) {
      c.t = t;
      c.uncertainty = reach;
      crossings.push_back(c);
    }
  }

  std::vector<OnBorder> borders;
  for (std::size_t i = 0; i < roots.size(); i++) {
    if (at_pole[i]) continue;
    auto border = on_border(roots[i]);
    if (!border) {
      add(roots[i]);
      continue;
    }
    border->root = i;
    borders.push_back(std::move(*border));
  }
  const auto earlier = [&](std::size_t a, std::size_t b) {
    const LineRoot &x = roots[a], &y = roots[b];
    return std::tuple(facets_[x.facet]->part, x.u, x.v) < std::tuple(facets_[y.facet]->part, y.u, y.v);
  };
  for (OnBorder& first : borders) {
    if (first.grouped) continue;
    std::vector<std::size_t> members;
    std::vector<std::vector<dvec3>> fans;
    bool flagged = false;
    for (OnBorder& other : borders) {
      const double reach =
          same_place * extent_ + 4 * std::max(first.gap, other.gap) + (roots[other.root].high - roots[other.root].low);
      if (other.grouped || glm::distance(roots[first.root].place, roots[other.root].place) > reach) continue;
      other.grouped = true;
      members.push_back(other.root);
      fans.push_back(other.fan);
      flagged = flagged || !roots[other.root].is_single();
    }
    std::ranges::sort(members, earlier);
    const auto sheets = std::size_t(std::max(1, members.size() > 1 ? sheets_passed(fans, d) : 1));
    if (flagged) {
      // One stands for all of them, on both sides of the border.
      LineRoot all =
          roots[*std::ranges::max_element(members, {}, [&](std::size_t i) { return roots[i].high - roots[i].low; })];
      for (const std::size_t i : members) {
        all.low = std::min(all.low, roots[i].low);
        all.high = std::max(all.high, roots[i].high);
      }
      add(all);
      continue;
    }
    for (std::size_t i = 0; i < std::min(sheets, members.size()); i++) add(roots[members[i]]);
  }

  for (ParametricCrossing& c : crossings) {
    c.t = (c.t + shift) / length;
    c.uncertainty /= length;
  }
  std::ranges::sort(crossings, [&](const ParametricCrossing& a, const ParametricCrossing& b) {
    return std::tuple(float(a.t), facets_[a.facet]->part, a.u, a.v) <
           std::tuple(float(b.t), facets_[b.facet]->part, b.u, b.v);
  });
  return crossings;
}

// A pole is one point, whose coordinate along the side is the start of its range.
std::vector<ParametricCrossing> ReferenceCrossings::at(const ReferencePole& pole, std::uint32_t number,
                                                       const dvec3& d) const {
  constexpr int samples = 16;
  std::vector<std::vector<dvec3>> fans;
  const ReferenceSide* first = nullptr;
  for (const ReferenceSide& side : pole.sides) {
    const ReferenceFacet& facet = *facets_[side.facet];
    std::vector<dvec3> fan;
    for (int i = 0; i <= samples; i++) {
      const dvec2 at = place_on_side(facet, side.side, double(i) / samples);
      fan.push_back(inwards(facet.at(at.x, at.y, 1), side.side));
    }
    fans.push_back(std::move(fan));
    if (!first || facet.part < facets_[first->facet]->part) first = &side;
  }
  const ReferenceFacet& facet = *facets_[first->facet];
  dvec2 coordinates = place_on_side(facet, first->side, 0);
  coordinates[first->side < 2 ? 1 : 0] = facet.part_lower[first->side < 2 ? 1 : 0];
  ParametricCrossing c{.facet = first->facet, .u = coordinates.x, .v = coordinates.y, .place = pole.position};
  c.pole = number;
  return std::vector<ParametricCrossing>(std::size_t(std::max(1, sheets_passed(fans, d))), c);
}

}  // namespace smurf
