// A piece covers the samples that lie within its radius of its axis, as seen. There the normal of the tube is known
// from the distance to the axis: across it at the rim, to the eye in the middle.
#include "techniques/lines/tubes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace smurf {

namespace {

constexpr int band_rows = 32;  // so that the samples of a band stay in a cache

struct Sample {
  float depth = std::numeric_limits<float>::infinity();
  glm::vec3 colour{0.0f};
};

// Light from the upper left, fixed to the camera, and from the eye.
glm::vec3 lit(const glm::vec3& colour, const glm::vec3& normal, const glm::vec3& to_eye) {
  static const glm::vec3 key = glm::normalize(glm::vec3(-0.55f, 0.75f, -1.0f));
  const float head = std::max(0.0f, glm::dot(normal, to_eye)), side = std::max(0.0f, glm::dot(normal, key));
  const float gloss = std::pow(std::max(0.0f, glm::dot(normal, glm::normalize(key + to_eye))), 40.0f);
  return colour * (0.10f + 0.38f * head + 0.62f * side) + 0.22f * gloss * std::min(1.0f, 4 * side);
}

class Band {
 public:
  Band(int width, int top, int rows, int samples)
      : width_(width),
        top_(top),
        rows_(rows),
        samples_(samples),
        buffer_(std::size_t(width) * std::size_t(samples) * std::size_t(rows) * std::size_t(samples)) {}

  void draw(const TubePiece& piece);
  void develop(std::vector<TubePixel>& pixels) const;

 private:
  std::size_t row_length() const { return std::size_t(width_) * std::size_t(samples_); }

  int width_, top_, rows_, samples_;
  std::vector<Sample> buffer_;
};

// The samples, counted from 0, whose centres lie in [lower, upper] pixels.
struct Span {
  int first, last;
};
Span span_of(float lower, float upper, int samples, int count) {
  const float first = std::ceil(lower * float(samples) - 0.5f), last = std::floor(upper * float(samples) - 0.5f);
  return {int(std::clamp(first, 0.0f, float(count))), int(std::clamp(last, -1.0f, float(count - 1)))};
}

void Band::draw(const TubePiece& piece) {
  const float reach = std::max(piece.from_radius, piece.to_radius);
  const Span columns = span_of(std::min(piece.from.x, piece.to.x) - reach, std::max(piece.from.x, piece.to.x) + reach,
                               samples_, width_ * samples_);
  const float top = float(top_);
  const Span rows = span_of(std::min(piece.from.y, piece.to.y) - reach - top,
                            std::max(piece.from.y, piece.to.y) + reach - top, samples_, rows_ * samples_);
  const glm::vec2 along = piece.to - piece.from;
  const float length2 = glm::dot(along, along);
  const glm::vec3 across = glm::cross(piece.tangent, piece.to_eye);
  const float sine = glm::length(across);
  const bool end_on = sine < 1e-3f;  // the tube points at the eye: what is seen of it is a ball
  const glm::vec3 side = end_on ? glm::vec3(0.0f) : across / sine;
  const glm::vec3 front = end_on ? piece.to_eye : glm::cross(side, piece.tangent);
  for (int j = rows.first; j <= rows.last; j++) {
    for (int i = columns.first; i <= columns.last; i++) {
      const glm::vec2 place((float(i) + 0.5f) / float(samples_), top + (float(j) + 0.5f) / float(samples_));
      const float t = length2 > 0 ? std::clamp(glm::dot(place - piece.from, along) / length2, 0.0f, 1.0f) : 0.0f;
      const glm::vec2 off = place - (piece.from + t * along);
      const float radius = glm::mix(piece.from_radius, piece.to_radius, t);
      const glm::vec2 offset = off / radius;
      const float distance2 = glm::dot(offset, offset);
      if (!(distance2 < 1)) continue;
      const float height = std::sqrt(1 - distance2);
      const float axis = 1 / glm::mix(1 / piece.from_depth, 1 / piece.to_depth, t);
      const float depth = axis - height * radius * piece.units_per_pixel;
      Sample& sample = buffer_[std::size_t(j) * row_length() + std::size_t(i)];
      if (!(depth < sample.depth)) continue;
      sample.depth = depth;
      sample.colour = glm::mix(piece.from_colour, piece.to_colour, t);
      if (!piece.lit) continue;
      const glm::vec3 rim(offset.x, -offset.y, 0);
      const glm::vec3 outwards = end_on ? rim : side * std::copysign(std::sqrt(distance2), glm::dot(rim, side));
      sample.colour = lit(sample.colour, outwards + height * front, piece.to_eye);
    }
  }
}

void Band::develop(std::vector<TubePixel>& pixels) const {
  const float share = 1.0f / float(samples_ * samples_);
  for (int y = 0; y < rows_; y++) {
    for (int x = 0; x < width_; x++) {
      TubePixel pixel;
      int covered = 0;
      for (int s = 0; s < samples_ * samples_; s++) {
        const Sample& sample =
            buffer_[std::size_t(y * samples_ + s / samples_) * row_length() + std::size_t(x * samples_ + s % samples_)];
        if (!std::isfinite(sample.depth)) continue;
        covered++;
        pixel.colour += share * sample.colour;
        pixel.depth += sample.depth;
      }
      if (covered == 0) continue;
      pixel.coverage = share * float(covered);
      pixel.depth /= float(covered);
      pixels[std::size_t(top_ + y) * std::size_t(width_) + std::size_t(x)] = pixel;
    }
  }
}

}  // namespace

std::vector<TubePixel> draw_tubes(const std::vector<TubePiece>& pieces, int width, int height, int samples) {
  std::vector<TubePixel> pixels(std::size_t(width) * std::size_t(height));
  const std::size_t bands = (std::size_t(height) + band_rows - 1) / band_rows;
  std::vector<std::vector<std::uint32_t>> of_band(bands);
  for (std::size_t i = 0; i < pieces.size(); i++) {
    const TubePiece& piece = pieces[i];
    const float reach = std::max(piece.from_radius, piece.to_radius);
    const float first = (std::min(piece.from.y, piece.to.y) - reach) / band_rows;
    const float last = (std::max(piece.from.y, piece.to.y) + reach) / band_rows;
    if (!(last >= 0) || !(first < float(bands))) continue;
    const auto begin = std::size_t(std::max(first, 0.0f));
    const auto end = std::min(std::size_t(std::min(last, float(bands))) + 1, bands);
    for (std::size_t band = begin; band < end; band++) of_band[band].push_back(std::uint32_t(i));
  }
  for (std::size_t i = 0; i < bands; i++) {
    const int top = int(i) * band_rows;
    Band band(width, top, std::min(band_rows, height - top), samples);
    for (const std::uint32_t piece : of_band[i]) band.draw(pieces[piece]);
    band.develop(pixels);
  }
  return pixels;
}

}  // namespace smurf
