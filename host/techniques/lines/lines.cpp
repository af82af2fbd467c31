// What lines are drawn with: velocities, numbers and their colours, the box; then pieces, tubes, depth and the legend.
#include "smurf/lines.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "smurf/error.hpp"
#include "techniques/colour_map.hpp"
#include "techniques/legend.hpp"
#include "techniques/lines/depth.hpp"
#include "techniques/lines/pieces.hpp"

namespace smurf {

namespace {

constexpr std::array<std::string_view, 3> shade_names{"speed", "time", "none"};

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void check(const Streamlines& lines, std::size_t velocities, const LineRenderOptions& options) {
  const auto fail = [](const std::string& message) { throw Error(ErrorCode::usage, message); };
  if (velocities != 0 && velocities != lines.positions.size())
    fail(fmt::format("{} velocities for lines of {} rows", velocities, lines.positions.size()));
  if (options.samples < 1 || options.samples > 16)
    fail(fmt::format("samples must be 1 to 16, not {}", options.samples));
  if (!(options.radius >= 0) || !std::isfinite(options.radius))
    fail(fmt::format("the radius of lines must be positive, not {}", options.radius));
  if (options.range &&
      !(options.range->lower < options.range->upper && std::isfinite(options.range->upper - options.range->lower)))
    fail(fmt::format("the range must be two finite numbers, the lower first, not {:g},{:g}", options.range->lower,
                     options.range->upper));
  const double samples = double(options.camera.width) * options.camera.height * options.samples * options.samples;
  constexpr double most = 1u << 28;
  if (samples > most)
    fail(fmt::format("{} x {} pixels with {} x {} samples each are more than the {:.0f} samples of a picture",
                     options.camera.width, options.camera.height, options.samples, options.samples, most));
}

// The velocity of each row; differences of rows where the field gives none.
std::vector<glm::vec3> row_velocities(const Streamlines& lines, std::span<const glm::vec3> given) {
  std::vector<glm::vec3> velocities(lines.positions.size(), glm::vec3(0.0f));
  for (std::size_t line = 0; line < lines.size(); line++) {
    const std::size_t begin = lines.offsets[line], end = lines.offsets[line + 1];
    for (std::size_t row = begin; row < end; row++) {
      if (!given.empty() && is_finite(given[row])) {
        velocities[row] = given[row];
        continue;
      }
      const std::size_t before = row > begin ? row - 1 : row, behind = row + 1 < end ? row + 1 : row;
      const float time = lines.times[behind] - lines.times[before];
      if (time != 0) velocities[row] = (lines.positions[behind] - lines.positions[before]) / time;
    }
  }
  return velocities;
}

// Down or up to two digits.
double rounded(double x, bool up) {
  if (x == 0 || !std::isfinite(x)) return x;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(x))) - 1);
  return (up ? std::ceil(x / unit - 1e-9) : std::floor(x / unit + 1e-9)) * unit;
}

ValueRange range_of(std::vector<float> numbers, LineShade shade) {
  std::erase_if(numbers, [](float x) { return !std::isfinite(x); });
  if (numbers.empty()) return {0, 1};
  const auto quantile = [&](double share) {
    const auto place = numbers.begin() + std::ptrdiff_t(std::lround(share * double(numbers.size() - 1)));
    std::nth_element(numbers.begin(), place, numbers.end());
    return double(*place);
  };
  const bool ends = shade == LineShade::time;
  const ValueRange range{rounded(quantile(ends ? 0 : 0.01), false), rounded(quantile(ends ? 1 : 0.99), true)};
  // A flow of one speed has no range of its own.
  const double least = 1e-3 * std::max(std::abs(range.lower), std::abs(range.upper));
  if (range.upper - range.lower > least) return range;
  return shade == LineShade::speed && range.upper > 0 ? ValueRange{0, 2 * range.upper}
                                                      : ValueRange{range.lower - 0.5, range.upper + 0.5};
}

Bounds bounds_of(const Streamlines& lines, const std::optional<Bounds>& box) {
  Bounds bounds = box.value_or(Bounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                                      glm::dvec3(-std::numeric_limits<double>::infinity())});
  for (const glm::vec3& position : lines.positions) {
    if (!is_finite(position)) continue;
    bounds.lower = glm::min(bounds.lower, glm::dvec3(position));
    bounds.upper = glm::max(bounds.upper, glm::dvec3(position));
  }
  return bounds;
}

std::vector<float> numbers_of(const Streamlines& lines, const std::vector<glm::vec3>& velocities, LineShade shade) {
  std::vector<float> numbers(lines.times.begin(), lines.times.end());
  for (std::size_t row = 0; shade == LineShade::speed && row < numbers.size(); row++)
    numbers[row] = glm::length(velocities[row]);
  return numbers;
}

}  // namespace

std::string_view name_of(LineShade shade) { return shade_names[std::size_t(shade)]; }

LineShade line_shade_named(std::string_view name) {
  for (std::size_t i = 0; i < shade_names.size(); i++)
    if (shade_names[i] == name) return LineShade(i);
  throw Error(ErrorCode::usage,
              fmt::format("unknown shade \"{}\" of lines; known are {}", name, fmt::join(shade_names, ", ")));
}

Image render(const Streamlines& lines, std::span<const glm::vec3> given, const LineRenderOptions& options) {
  check(lines, given.size(), options);
  static const glm::vec3 plain = to_linear({0.93f, 0.80f, 0.62f}), frame = to_linear(glm::vec3(0.42f));
  const Camera& camera = options.camera;
  const Bounds bounds = bounds_of(lines, options.box);
  const double extent = std::max(0.0, glm::length(bounds.upper - bounds.lower));
  const std::vector<glm::vec3> velocities = row_velocities(lines, given);
  const std::vector<float> numbers = numbers_of(lines, velocities, options.shade);
  const ColourMap map(ColourScale::viridis);
  const ValueScale scale(options.range.value_or(range_of(numbers, options.shade)));
  const auto colour_of = [&](std::size_t row) {
    return options.shade == LineShade::none ? plain : map(scale.place(numbers[row]));
  };

  LinePieces pieces(camera, options.radius > 0 ? options.radius : extent / 500, 1e-4 * extent);
  for (std::size_t line = 0; line < lines.size(); line++) {
    for (std::size_t row = lines.offsets[line]; row + 1 < lines.offsets[line + 1]; row++) {
      const double time = double(lines.times[row + 1]) - double(lines.times[row]);
      pieces.add_cubic(lines.positions[row], time * glm::dvec3(velocities[row]), lines.positions[row + 1],
                       time * glm::dvec3(velocities[row + 1]), colour_of(row), colour_of(row + 1));
    }
  }
  if (options.box) pieces.add_box(*options.box, frame);
  Image image =
      with_depth(draw_tubes(pieces.take(), camera.width, camera.height, options.samples), camera.width, camera.height);
  if (options.legend && options.shade != LineShade::none) draw_legend(image, map, scale, name_of(options.shade));
  return image;
}

}  // namespace smurf
