#include "reference/walk/parametric_charts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/polynomial.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr int samples = 16;           // of a side
constexpr double same = 1e-9;         // of the extent: points that are one, beside the gap of sides
constexpr double beside_pole = 1e-6;  // of a facet
constexpr double on_side = 1e-9;      // of a facet's size
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

ParametricCharts::ParametricCharts(const std::vector<std::unique_ptr<ReferenceFacet>>& facets,
                                   const ReferenceBorders& borders, double extent)
    : facets_(facets), borders_(borders), extent_(extent) {
  for (const auto& facet : facets_) {
    for (int side = 0; side < 4; side++) {
      Box box{dvec3(infinity), dvec3(-infinity)};
      double longest = 0;
      dvec3 last(0.0);
      for (int i = 0; i <= samples; i++) {
        const dvec2 at = place_on_side(*facet, side, double(i) / samples);
        const dvec3 s = facet->at(at.x, at.y, 0).s;
        box.lower = glm::min(box.lower, s);
        box.upper = glm::max(box.upper, s);
        if (i > 0) longest = std::max(longest, glm::distance(s, last));
        last = s;
      }
      // What bends between samples.
      const dvec3 room(longest + 1e-6 * extent_);
      boxes_.push_back({box.lower - room, box.upper + room});
    }
  }
}

ChartPoint ParametricCharts::point(std::uint32_t chart, const dvec2& at) const {
  const ReferenceJet jet = facets_[chart]->at(at.x, at.y, 1);
  return {jet.s, jet.u, jet.v, false};
}

std::vector<ChartPlace> ParametricCharts::same_point(const ChartPlace& place) const {
  std::vector<ChartPlace> found;
  const dvec3 q = point(place.chart, place.at).s;
  for (std::uint32_t chart = 0; chart < facets_.size(); chart++) {
    const ReferenceFacet& facet = *facets_[chart];
    for (int side = 0; side < 4; side++) {
      const ReferenceSide& border = borders_.side(chart, side);
      const Box& box = boxes_[4 * chart + std::size_t(side)];
      if (border.pole != no_pole || glm::any(glm::lessThan(q, box.lower - border.gap)) ||
          glm::any(glm::greaterThan(q, box.upper + border.gap)))
        continue;
      double along = 0, least = infinity;
      for (int i = 0; i <= samples; i++) {
        const dvec2 at = place_on_side(facet, side, double(i) / samples);
        const double distance = glm::distance(facet.at(at.x, at.y, 0).s, q);
        if (distance < least) least = distance, along = double(i) / samples;
      }
      const int axis = 1 - side / 2;
      const double size = facet.upper[axis] - facet.lower[axis];
      for (int i = 0; i < 30; i++) {
        const dvec2 at = place_on_side(facet, side, along);
        const ReferenceJet jet = facet.at(at.x, at.y, 1);
        const dvec3 tangent = size * (axis == 0 ? jet.u : jet.v);
        const double square = glm::dot(tangent, tangent);
        if (!(square > 0)) break;
        along = std::clamp(along - glm::dot(jet.s - q, tangent) / square, 0.0, 1.0);
      }
      const dvec2 at = place_on_side(facet, side, along);
      const bool here = chart == place.chart &&
                        glm::all(glm::lessThanEqual(glm::abs(at - place.at), on_side * (facet.upper - facet.lower)));
      if (!here && glm::distance(facet.at(at.x, at.y, 0).s, q) <= 2 * border.gap + same * extent_)
        found.push_back({chart, at});
    }
  }
  return found;
}

std::vector<ChartPlace> ParametricCharts::around_pole(const ChartPlace& place, const SectionStart& start) const {
  std::vector<ChartPlace> found;
  const ReferenceFacet& here = *facets_[place.chart];
  for (int side = 0; side < 4; side++) {
    const ReferenceSide& border = borders_.side(place.chart, side);
    const int axis = side / 2;
    const double end = side % 2 == 0 ? here.lower[axis] : here.upper[axis];
    const double range = here.upper[axis] - here.lower[axis];
    if (border.pole == no_pole || std::abs(place.at[axis] - end) > 2 * beside_pole * range) continue;
    for (const ReferenceSide& other : borders_.poles()[border.pole].sides) {
      const ReferenceFacet& facet = *facets_[other.facet];
      const int across = other.side / 2;
      const auto at = [&](double along) {
        dvec2 beside = place_on_side(facet, other.side, along);
        beside[across] +=
            (other.side % 2 == 0 ? beside_pole : -beside_pole) * (facet.upper[across] - facet.lower[across]);
        return beside;
      };
      const auto f = [&](double along) {
        const dvec2 beside = at(along);
        return glm::dot(facet.at(beside.x, beside.y, 0).s - start.location, start.across());
      };
      constexpr int count = 64;
      double before = f(0);
      for (int i = 1; i <= count; i++) {
        const double after = f(double(i) / count);
        if ((before > 0) != (after > 0))
          found.push_back(
              {other.facet, at(bracketed_root(f, double(i - 1) / count, double(i) / count, before, after))});
        before = after;
      }
    }
  }
  return found;
}

}  // namespace smurf
