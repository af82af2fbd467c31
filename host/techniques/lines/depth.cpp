// Shade about what is near is the difference of a pixel's depth from the mean depth of what is covered around it (Luft,
// Colditz, Deussen 2006, of which only the darkening is used).
#include "techniques/lines/depth.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "techniques/colour_map.hpp"

namespace smurf {

namespace {

constexpr float fade = 0.5f;        // of the farthest
constexpr float darkest = 0.75f;    // by how much shade takes light away at most
constexpr float full_shade = 0.2f;  // what is so much of the range of depths behind its surroundings

// Coverage, and depth times coverage, so that blurring both gives a mean over what is covered.
using Planes = std::vector<glm::vec2>;

std::vector<float> gaussian(double deviation) {
  const int reach = int(std::ceil(2.5 * deviation));
  std::vector<float> weights;
  for (int i = -reach; i <= reach; i++) weights.push_back(float(std::exp(-0.5 * i * i / (deviation * deviation))));
  return weights;
}

// Along rows (stride 1) or columns; what lies outside of the picture is not covered.
Planes blurred(const Planes& planes, const std::vector<float>& weights, int width, int height, bool along_rows) {
  Planes result(planes.size(), glm::vec2(0.0f));
  const int reach = int(weights.size()) / 2;
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) {
      const int place = along_rows ? x : y, length = along_rows ? width : height;
      const std::ptrdiff_t stride = along_rows ? 1 : width;
      const std::ptrdiff_t at = std::ptrdiff_t(y) * width + x;
      glm::vec2 sum(0.0f);
      const int first = std::max(-reach, -place), last = std::min(reach, length - 1 - place);
      for (std::ptrdiff_t i = first; i <= last; i++)
        sum += weights[std::size_t(i + reach)] * planes[std::size_t(at + i * stride)];
      result[std::size_t(at)] = sum;
    }
  }
  return result;
}

}  // namespace

Image with_depth(const std::vector<TubePixel>& pixels, int width, int height) {
  float nearest = std::numeric_limits<float>::infinity(), farthest = -nearest;
  Planes planes;
  planes.reserve(pixels.size());
  for (const TubePixel& pixel : pixels) {
    planes.emplace_back(pixel.coverage, pixel.coverage * pixel.depth);
    if (pixel.coverage == 0) continue;
    nearest = std::min(nearest, pixel.depth);
    farthest = std::max(farthest, pixel.depth);
  }
  const float depths = farthest - nearest;
  const std::vector<float> weights = gaussian(std::max(1.0, std::min(width, height) / 90.0));
  planes = blurred(blurred(planes, weights, width, height, true), weights, width, height, false);

  Image image{width, height, std::vector<std::uint8_t>(pixels.size() * 4, 255)};
  for (int y = 0; y < height; y++) {
    const glm::vec3 background = backdrop((y + 0.5) / height);
    for (int x = 0; x < width; x++) {
      const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
      const TubePixel& pixel = pixels[i];
      glm::vec3 colour = background;
      if (pixel.coverage > 0) {
        const float behind = depths > 0 ? (pixel.depth - planes[i].y / planes[i].x) / (full_shade * depths) : 0.0f;
        const float place = depths > 0 ? (pixel.depth - nearest) / depths : 0.0f;
        const glm::vec3 lines = pixel.colour * (1 - darkest * std::clamp(behind, 0.0f, 1.0f));
        colour = glm::mix(lines, pixel.coverage * background, fade * place) + (1 - pixel.coverage) * background;
      }
      const glm::vec3 display = to_display(colour);
      for (int c = 0; c < 3; c++) image.rgba[4 * i + std::size_t(c)] = std::uint8_t(std::lround(255 * display[c]));
    }
  }
  return image;
}

}  // namespace smurf
