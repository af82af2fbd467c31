// A small bitmap font for legends: digits, lower-case letters and a few signs, 5 by 7 dots.
#pragma once

#include <string_view>

namespace smurf {

constexpr int glyph_width = 5;
constexpr int glyph_height = 7;
constexpr int glyph_advance = 6;

// Whether the dot in this column and row (0, 0 upper left) of the glyph is set. Capitals look like small
// letters; a character without a glyph is a blank.
bool glyph_dot(char character, int column, int row);

inline int text_width(std::string_view text) { return text.empty() ? 0 : int(text.size()) * glyph_advance - 1; }

}  // namespace smurf
