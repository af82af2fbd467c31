// Legends: what the colours of a map stand for.
#pragma once

#include <string_view>

#include "smurf/image.hpp"
#include "smurf/render.hpp"
#include "techniques/colour_map.hpp"

namespace smurf {

// Numbers to places on a colour map. When the range spans 0, 0 takes the middle and each side its own scale.
class ValueScale {
 public:
  explicit ValueScale(const ValueRange& range) : range_(range), spans_zero_(range.lower < 0 && range.upper > 0) {}
  double place(double value) const;  // 0 at the lower end, 1 at the upper
  double value(double place) const;

 private:
  ValueRange range_;
  bool spans_zero_;
};

// Draws a bar with ticks, numbers and a title at the right edge; nothing where it would fill more than
// two fifths of the width or does not fit the height.
void draw_legend(Image& image, const ColourMap& map, const ValueScale& scale, std::string_view title);

}  // namespace smurf
