#include "techniques/legend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "techniques/canvas.hpp"

namespace smurf {

namespace {

constexpr int tick_count = 5;

}  // namespace

double ValueScale::place(double value) const {
  if (spans_zero_) return value < 0 ? 0.5 - 0.5 * value / range_.lower : 0.5 + 0.5 * value / range_.upper;
  return (value - range_.lower) / (range_.upper - range_.lower);
}

double ValueScale::value(double place) const {
  if (spans_zero_) return place < 0.5 ? range_.lower * (1 - 2 * place) : range_.upper * (2 * place - 1);
  return std::lerp(range_.lower, range_.upper, place);
}

void draw_legend(Image& image, const ColourMap& map, const ValueScale& scale, std::string_view title) {
  std::array<std::string, tick_count> labels;
  int longest = 0;
  for (int i = 0; i < tick_count; i++) {
    labels[std::size_t(i)] = fmt::format("{:.3g}", scale.value(double(i) / (tick_count - 1)));
    longest = std::max(longest, text_width(labels[std::size_t(i)]));
  }
  const int dot = std::max(1, std::min(image.width, image.height) / 400);
  const int gap = 6 * dot;
  const int bar_width = 12 * dot;
  const int bar_height = std::max(80 * dot, image.height / 3);
  const int tick = 3 * dot;
  const int width = gap + std::max(bar_width + tick + 4 * dot + longest * dot, text_width(title) * dot) + gap;
  const int height = gap + glyph_height * dot + gap + bar_height + glyph_height * dot / 2 + gap;
  if (width * 5 > image.width * 2 || height + 2 * gap > image.height) return;

  Canvas canvas(image);
  const int left = image.width - width - gap, top = gap;
  canvas.fill(left, top, width, height, canvas_paper, 0.7f);
  canvas.text(left + gap, top + gap, title, dot);
  const int bar_left = left + gap, bar_top = top + gap + glyph_height * dot + gap;
  canvas.fill(bar_left - dot, bar_top - dot, bar_width + 2 * dot, bar_height + 2 * dot, canvas_ink);
  for (int y = 0; y < bar_height; y++) {
    canvas.fill(bar_left, bar_top + y, bar_width, 1, to_display(map(1 - double(y) / (bar_height - 1))));
  }
  for (int i = 0; i < tick_count; i++) {
    const int y = bar_top + (bar_height - 1) * (tick_count - 1 - i) / (tick_count - 1);
    canvas.fill(bar_left + bar_width, y - dot / 2, tick + dot, dot, canvas_ink);
    canvas.text(bar_left + bar_width + tick + 4 * dot, y - glyph_height * dot / 2, labels[std::size_t(i)], dot);
  }
}

}  // namespace smurf
