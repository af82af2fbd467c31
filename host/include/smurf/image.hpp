// Images: 8-bit RGBA, rows from the top, alpha not multiplied into the colours.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace smurf {

struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  // 4 bytes a pixel, width * height pixels
};

// Writes a PNG file, whole or not at all; without an alpha channel when every pixel is opaque.
// Throws Error (input) when the sizes and the pixels disagree, Error (io) when the file cannot be written.
void save_png(const Image& image, const std::filesystem::path& file);

}  // namespace smurf
