#include "reference/parametric/borders.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "surfaces/parametric/definition.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr int samples = 16;          // of a side, and one more
constexpr double collapsing = 1e-7;  // of the extent, that a collapsed side stays within
constexpr double meeting = 1e-6;     // of the extent, between sides that are one edge
constexpr double infinity = std::numeric_limits<double>::infinity();

using SidePoints = std::array<dvec3, samples + 1>;
using Facets = std::vector<std::unique_ptr<ReferenceFacet>>;

SidePoints points_of(const ReferenceFacet& facet, int side) {
  SidePoints points;
  for (std::size_t i = 0; i <= samples; i++) {
    const dvec2 at = place_on_side(facet, side, double(i) / samples);
    points[i] = facet.at(at.x, at.y, 0).s;
  }
  return points;
}

// The lesser of the greatest distances, where one is run through forwards or backwards.
double gap_between(const SidePoints& a, const SidePoints& b) {
  double forwards = 0, backwards = 0;
  for (std::size_t i = 0; i <= samples; i++) {
    // Written so that points that are undefined are infinitely far from others.
    const double f = glm::distance(a[i], b[i]), r = glm::distance(a[i], b[samples - i]);
    forwards = std::isnan(f) ? infinity : std::max(forwards, f);
    backwards = std::isnan(r) ? infinity : std::max(backwards, r);
  }
  return std::min(forwards, backwards);
}

}  // namespace

dvec2 place_on_side(const ReferenceFacet& facet, int side, double along) {
  const int across = side / 2;
  dvec2 at = facet.lower + along * (facet.upper - facet.lower);
  at[across] = side % 2 == 0 ? facet.lower[across] : facet.upper[across];
  return at;
}

dvec3 inwards(const ReferenceJet& jet, int side) { return (side % 2 == 0 ? 1.0 : -1.0) * (side < 2 ? jet.u : jet.v); }

ReferenceBorders::ReferenceBorders(const Facets& facets, const ParametricSurface& surface, double extent) {
  for (std::uint32_t i = 0; i < facets.size(); i++) {
    for (int side = 0; side < 4; side++) sides_.push_back({i, side});
  }
  find_poles(facets, extent);
  find_gaps(facets, surface, extent);
}

void ReferenceBorders::find_poles(const Facets& facets, double extent) {
  for (ReferenceSide& side : sides_) {
    if (!facets[side.facet]->border[std::size_t(side.side)]) continue;
    const SidePoints points = points_of(*facets[side.facet], side.side);
    dvec3 lower(infinity), upper(-infinity);
    for (const dvec3& p : points) {
      lower = glm::min(lower, p);
      upper = glm::max(upper, p);
    }
    const double size = glm::length(upper - lower);
    if (!(size <= collapsing * extent)) continue;
    const dvec3 middle = 0.5 * (lower + upper);
    std::uint32_t number = 0;
    while (number < poles_.size() && !(glm::distance(poles_[number].position, middle) <= meeting * extent)) number++;
    if (number == poles_.size()) poles_.push_back({middle, 0, {}});
    ReferencePole& pole = poles_[number];
    pole.radius = std::max(pole.radius, glm::distance(pole.position, middle) + size);
    side.pole = number;
    pole.sides.push_back(side);
  }
}

void ReferenceBorders::find_gaps(const Facets& facets, const ParametricSurface& surface, double extent) {
  struct Entry {
    ReferenceSide* side;
    SidePoints points;
    double place;
  };
  std::vector<Entry> entries;
  for (ReferenceSide& side : sides_) {
    if (!facets[side.facet]->border[std::size_t(side.side)] || side.pole != no_pole) continue;
    const SidePoints points = points_of(*facets[side.facet], side.side);
    const dvec3 middle = points[samples / 2];
    const double place = middle.x + 0.71 * middle.y + 0.43 * middle.z;
    if (std::isfinite(place)) entries.push_back({&side, points, place});
  }
  std::ranges::sort(entries, {}, &Entry::place);
  for (std::size_t i = 0; i < entries.size(); i++) {
    for (std::size_t j = i + 1; j < entries.size(); j++) {
      if (entries[j].place - entries[i].place > 3 * meeting * extent) break;
      const double gap = gap_between(entries[i].points, entries[j].points);
      if (!(gap <= meeting * extent)) continue;
      entries[i].side->gap = std::max(entries[i].side->gap, gap);
      entries[j].side->gap = std::max(entries[j].side->gap, gap);
    }
  }
  // Directions that are said to be closed, however far their ends are apart.
  if (!surface.patches.empty()) return;
  for (int direction = 0; direction < 2; direction++) {
    if (!surface.expressions.closed[std::size_t(direction)]) continue;
    ReferenceSide &first = sides_[2 * std::size_t(direction)], &second = sides_[2 * std::size_t(direction) + 1];
    const double gap = gap_between(points_of(*facets[0], first.side), points_of(*facets[0], second.side));
    if (std::isfinite(gap)) first.gap = second.gap = std::max(first.gap, gap);
  }
}

int sheets_passed(std::span<const std::vector<dvec3>> fans, const dvec3& d) {
  constexpr int moves = 16;
  const dvec3 axis = std::abs(d.x) < 0.6 * glm::length(d) ? dvec3(1, 0, 0) : dvec3(0, 1, 0);
  const dvec3 e1 = glm::normalize(glm::cross(d, axis)), e2 = glm::normalize(glm::cross(d, e1));
  const auto flat = [&](const dvec3& p) { return dvec2(glm::dot(p, e1), glm::dot(p, e2)); };
  const auto turn = [](const dvec2& a, const dvec2& b) { return a.x * b.y - a.y * b.x; };
  int fewest = std::numeric_limits<int>::max(), most = 0;
  bool all_odd = true;
  for (int k = 0; k < moves; k++) {
    const double angle = 2 * std::numbers::pi * (k + 0.3141) / moves;
    const dvec2 move(std::cos(angle), std::sin(angle));
    int count = 0;
    for (const std::vector<dvec3>& fan : fans) {
      for (std::size_t i = 0; i + 1 < fan.size(); i++) {
        const dvec2 a = flat(fan[i]), b = flat(fan[i + 1]);
        const double whole = turn(a, b);
        if (turn(a, move) * whole > 0 && turn(move, b) * whole > 0) count++;
      }
    }
    fewest = std::min(fewest, count);
    most = std::max(most, count);
    all_odd = all_odd && count % 2 == 1;
  }
  return all_odd ? fewest : most;
}

}  // namespace smurf
