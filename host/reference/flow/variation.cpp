#include "reference/flow/variation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/flow/extrapolation.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr int levels = 8;
// How far the farthest neighbours' seeds are off: of the domain's extent, or of a cell.
constexpr double of_extent = 0.02, of_cell = 0.25;

}  // namespace

LineVariation vary_line(const ReferenceFlow& flow, const ReferenceLine& line, const LineRequest& request,
                        const dvec3& tangent, const dvec3& second_tangent, int order) {
  const std::size_t count = line.points.size();
  LineVariation result{std::vector<dvec3>(count, dvec3(0.0)), std::vector<dvec3>(order > 1 ? count : 0, dvec3(0.0))};
  const dvec3 seed = line.points[0].position;
  const double speed = glm::length(tangent), bend = glm::length(second_tangent);
  if (speed == 0 && bend == 0) return result;
  const ReferencePlace place = flow.find(seed, slack_of(flow, seed));
  const double reach =
      flow.has_cells() ? of_cell * (place.piece < 0 ? 0 : flow.size(place.piece)) : of_extent * extent_of(flow);
  double widest = std::numeric_limits<double>::infinity();
  if (speed > 0) widest = reach / speed;
  if (bend > 0) widest = std::min(widest, std::sqrt(2 * reach / bend));

  std::vector<double> times;
  for (const LinePoint& point : line.points) times.push_back(std::abs(point.time));
  const double direction = request.time < 0 ? -1 : 1;
  // At the line's times, NaN where it is not that long.
  const auto neighbour = [&](double e) {
    const dvec3 from = seed + e * tangent + 0.5 * e * e * second_tangent;
    std::vector<dvec3> at(count, dvec3(std::numeric_limits<double>::quiet_NaN()));
    if (!flow.has_cells()) {
      const std::vector<LinePoint> points = repeat_line(flow, seed, from, direction, line.steps, times);
      for (std::size_t i = 0; i < points.size(); i++) at[i] = points[i].position;
      return at;
    }
    at[0] = from;
    if (times.back() == 0) return at;
    LineRequest own = request;
    own.time = direction * times.back();
    own.tolerance = std::min(request.tolerance, 1e-14);
    own.stagnation = 0;
    own.length = std::numeric_limits<double>::infinity();
    own.most_steps = std::numeric_limits<long>::max();
    own.beyond = true;
    own.times = &times;
    const ReferenceLine other = trace_line(flow, from, own);
    for (std::size_t i = 0; i < std::min(count, other.points.size()); i++)
      if (std::abs(other.points[i].time) == times[i]) at[i] = other.points[i].position;
    return at;
  };

  std::vector<std::vector<dvec3>> right, left;
  for (int k = 0; k < levels; k++) {
    right.push_back(neighbour(std::ldexp(widest, -k)));
    left.push_back(neighbour(-std::ldexp(widest, -k)));
  }
  for (std::size_t i = 0; i < count; i++) {
    result.first[i] = extrapolated<levels>([&](int k) {
      const auto at = std::size_t(k);
      return (right[at][i] - left[at][i]) / (2 * std::ldexp(widest, -k));
    });
    if (order > 1)
      result.second[i] = extrapolated<levels>([&](int k) {
        const auto at = std::size_t(k);
        const double e = std::ldexp(widest, -k);
        return (right[at][i] - 2.0 * line.points[i].position + left[at][i]) / (e * e);
      });
  }
  result.first[0] = tangent;
  if (order > 1) result.second[0] = second_tangent;
  return result;
}

}  // namespace smurf
