#include "surfaces/property_columns.hpp"

#include <numeric>

namespace smurf {

std::vector<std::size_t> column_widths(std::uint32_t wanted) {
  std::vector<std::size_t> widths;
  if (contains(wanted, Property::value)) widths.push_back(1);
  if (contains(wanted, Property::normal)) widths.push_back(3);
  if (contains(wanted, Property::gauss)) widths.push_back(1);
  if (contains(wanted, Property::mean)) widths.push_back(1);
  if (contains(wanted, Property::principal)) widths.insert(widths.end(), {1, 1});
  if (contains(wanted, Property::directions)) widths.insert(widths.end(), {3, 3});
  if (contains(wanted, Property::normal_curvature)) widths.push_back(1);
  if (contains(wanted, Property::location)) widths.push_back(3);
  widths.push_back(1);  // the status
  return widths;
}

std::size_t words_per_point(std::uint32_t wanted) {
  const std::vector<std::size_t> widths = column_widths(wanted);
  return std::accumulate(widths.begin(), widths.end(), std::size_t(0));
}

void take_columns(const std::shared_ptr<Values<std::uint32_t>>& words, std::size_t count, std::uint32_t wanted,
                  PointProperties& out) {
  std::size_t column = 0;
  const auto take = [&]<class T>(Column<T>& values) {
    values = Column<T>(words, std::span(reinterpret_cast<const T*>(words->data() + column * count), count));
    constexpr std::size_t word = 4;
    column += sizeof(T) / word;
  };
  if (contains(wanted, Property::value)) take(out.value);
  if (contains(wanted, Property::normal)) take(out.normal);
  if (contains(wanted, Property::gauss)) take(out.gauss);
  if (contains(wanted, Property::mean)) take(out.mean);
  if (contains(wanted, Property::principal)) take(out.k1), take(out.k2);
  if (contains(wanted, Property::directions)) take(out.d1), take(out.d2);
  if (contains(wanted, Property::normal_curvature)) take(out.normal_curvature);
  if (contains(wanted, Property::location)) take(out.location);
  take(out.status);
  out.measured |= wanted;
}

}  // namespace smurf
