#include "reference/walk/stream_charts.hpp"

#include <cmath>

namespace smurf {

using glm::dvec2;

ChartPoint StreamCharts::point(std::uint32_t chart, const dvec2& at) const {
  const ReferenceStreamMap::Jet jet = map_.jet(map_.stretches()[chart], at.x, at.y);
  // Where there is no velocity the line has ended before.
  return {jet.x, jet.u, jet.v, !(std::isfinite(glm::length(jet.v)) && std::isfinite(glm::length(jet.u)))};
}

std::vector<ChartPlace> StreamCharts::same_point(const ChartPlace& place) const {
  std::vector<ChartPlace> found;
  const auto& stretches = map_.stretches();
  const auto last = std::uint32_t(stretches.size() - 1);
  const dvec2 low = lower(place.chart), high = upper(place.chart), size = high - low;
  const auto is_at = [&](int axis, double value) { return std::abs(place.at[axis] - value) <= 1e-9 * size[axis]; };
  const auto add_u = [&](std::uint32_t chart, double u) { found.push_back({chart, dvec2(u, place.at.y)}); };
  if (is_at(0, low.x)) {
    if (place.chart > 0 && stretches[place.chart - 1].upper == low.x) add_u(place.chart - 1, low.x);
    if (place.chart == 0 && samples_.is_closed_in_u()) add_u(last, stretches[last].upper);
  }
  if (is_at(0, high.x)) {
    if (place.chart < last && stretches[place.chart + 1].lower == high.x) add_u(place.chart + 1, high.x);
    if (place.chart == last && samples_.is_closed_in_u()) add_u(0, stretches[0].lower);
  }
  if (samples_.is_closed_in_time()) {
    if (is_at(1, low.y)) found.push_back({place.chart, dvec2(place.at.x, high.y)});
    if (is_at(1, high.y)) found.push_back({place.chart, dvec2(place.at.x, low.y)});
  }
  return found;
}

}  // namespace smurf
