// What is written over finished pictures, in display colours: rectangles and text.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <string_view>

#include "smurf/image.hpp"
#include "techniques/font.hpp"

namespace smurf {

constexpr glm::vec3 canvas_ink{0.10f, 0.11f, 0.13f};
constexpr glm::vec3 canvas_paper{1.0f, 1.0f, 1.0f};

class Canvas {
 public:
  explicit Canvas(Image& image) : image_(image) {}

  void blend(int x, int y, const glm::vec3& colour, float opacity) {
    if (x < 0 || y < 0 || x >= image_.width || y >= image_.height) return;
    std::uint8_t* pixel = &image_.rgba[(std::size_t(y) * std::size_t(image_.width) + std::size_t(x)) * 4];
    for (int c = 0; c < 3; c++) {
      const float mixed = glm::mix(float(pixel[c]), 255 * colour[c], opacity);
      pixel[c] = std::uint8_t(std::lround(std::clamp(mixed, 0.0f, 255.0f)));
    }
  }

  void fill(int x, int y, int width, int height, const glm::vec3& colour, float opacity = 1) {
    for (int j = 0; j < height; j++) {
      for (int i = 0; i < width; i++) blend(x + i, y + j, colour, opacity);
    }
  }

  void text(int x, int y, std::string_view characters, int dot) {
    for (const char character : characters) {
      for (int row = 0; row < glyph_height; row++) {
        for (int column = 0; column < glyph_width; column++) {
          if (glyph_dot(character, column, row)) fill(x + column * dot, y + row * dot, dot, dot, canvas_ink);
        }
      }
      x += glyph_advance * dot;
    }
  }

 private:
  Image& image_;
};

// Words in the middle of the picture, in lines as wide as it is, on a light ground; what does not fit is cut off.
void write_centred(Image& image, std::string_view words);

}  // namespace smurf
