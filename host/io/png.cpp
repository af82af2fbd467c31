// PNG files through libpng's simplified interface, which reports errors in its structure and never jumps.
#include "io/png.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <string>

#include "io/atomic_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

struct PngImage : png_image {
  PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(this); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
};

bool is_opaque(const Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    if (image.rgba[i] != 255) return false;
  return true;
}

std::vector<std::uint8_t> without_alpha(const Image& image) {
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) rgb.insert(rgb.end(), &image.rgba[i], &image.rgba[i] + 3);
  return rgb;
}

}  // namespace

void save_png(const Image& image, const std::filesystem::path& file) {
  if (image.width < 1 || image.height < 1)
    throw Error(ErrorCode::input, fmt::format("an image of {} x {} pixels cannot be saved; both must be at least 1",
                                              image.width, image.height));
  const std::size_t expected = std::size_t(image.width) * std::size_t(image.height) * 4;
  if (image.rgba.size() != expected)
    throw Error(ErrorCode::input, fmt::format("an image of {} x {} pixels has {} bytes, not {}", image.width,
                                              image.height, expected, image.rgba.size()));
  const bool opaque = is_opaque(image);
  const std::vector<std::uint8_t> rgb = opaque ? without_alpha(image) : std::vector<std::uint8_t>();
  PngImage png;
  png.width = png_uint_32(image.width);
  png.height = png_uint_32(image.height);
  png.format = opaque ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  const void* pixels = opaque ? rgb.data() : image.rgba.data();
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels, 0, nullptr))
    throw Error(ErrorCode::io, fmt::format("cannot write \"{}\": {}", file.string(), png.message));
  bytes.resize(size);
  write_file(file, bytes);
}

Image load_png(const std::filesystem::path& file) {
  PngImage png;
  const auto check = [&](int succeeded) {
    if (!succeeded)
      throw Error(ErrorCode::input, fmt::format("cannot read \"{}\" as a PNG image: {}", file.string(), png.message));
  };
  check(png_image_begin_read_from_file(&png, file.c_str()));
  png.format = PNG_FORMAT_RGBA;
  Image image;
  image.width = int(png.width);
  image.height = int(png.height);
  image.rgba.resize(PNG_IMAGE_SIZE(png));
  check(png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr));
  return image;
}

}  // namespace smurf
