// Renders by casting one batch of rays and shading what was hit, in linear light: by techniques (technique.hpp), each
// of which asks for the properties that it needs.
//
// Every pixel has samples² rays on a regular grid, which are those of a camera with samples times the pixels.
#include "smurf/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "smurf/error.hpp"
#include "techniques/canvas.hpp"
#include "techniques/colour_map.hpp"
#include "techniques/legend.hpp"
#include "techniques/light.hpp"
#include "techniques/plan.hpp"

namespace smurf {

namespace {

// Up to two digits, so that the numbers of a legend are short.
double rounded_up(double x) {
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 1);
  return std::ceil(x / unit - 1e-9) * unit;
}

ValueRange range_of(std::vector<float> numbers, const Technique& colour) {
  std::erase_if(numbers, [](float x) { return !std::isfinite(x); });
  if (numbers.empty()) return {-1, 1};
  if (colour.scale == ColourScale::sequential) {
    const auto [least, greatest] = std::minmax_element(numbers.begin(), numbers.end());
    return *least < *greatest ? ValueRange{*least, *greatest} : ValueRange{*least - 0.5, *least + 0.5};
  }
  for (float& x : numbers) x = std::abs(x);
  const float usual = usual_greatest(std::move(numbers));
  if (!(usual > std::numeric_limits<float>::min())) return {-1, 1};  // flat: all in the middle of the map
  const double bound = rounded_up(usual);
  return {-bound, bound};
}

class Shader {
 public:
  Shader(const Plan& plan, const Scene& scene, const RenderOptions& options)
      : plan_(plan),
        scene_(scene),
        lights_(lights_of(options.camera)),
        map_(plan.colour ? plan.colour->scale : ColourScale::diverging),
        scale_(options.range         ? *options.range
               : plan.maps_numbers() ? range_of({scene.numbers.begin(), scene.numbers.end()}, *plan.colour)
                                     : ValueRange{0, 1}) {
    if (plan.layers) opacities_ = plan.layers->opacity(scene);
    if (plan.marks.empty()) return;
    ink_.emplace(scene.width(), scene.height());
    for (const Technique* mark : plan.marks) mark->mark(scene, *ink_);
  }

  const ColourMap& map() const { return map_; }
  const ValueScale& scale() const { return scale_; }

  glm::vec3 background(double height) const {  // 0 at the top, 1 at the bottom
    return plan_.shadow_alone() ? glm::vec3(0.0f) : backdrop(height);
  }

  // What a ray sees.
  glm::vec3 operator()(std::size_t ray, const glm::vec3& background) const {
    const auto offsets = scene_.hits.offsets();
    const std::size_t begin = offsets[ray], end = offsets[ray + 1];
    glm::vec3 seen(0.0f);
    float through = 1;  // the share of light from behind
    for (std::size_t hit = begin; hit < end && through > 1e-3f; hit++) {
      const float opacity = opacities_.empty() ? 1 : opacities_[hit];
      seen += through * opacity * colour_of_hit(hit, scene_.direction(ray));
      through *= 1 - opacity;
    }
    seen += through * background;
    if (!ink_) return seen;
    const glm::vec4 ink = ink_->at(ray);
    return glm::mix(seen, glm::vec3(ink), ink.w);
  }

 private:
  glm::vec3 colour_of_hit(std::size_t hit, const glm::vec3& direction) const {
    const glm::vec3 normal = facing(hit, direction);
    const float cosine = -glm::dot(normal, direction);
    if (plan_.shadow_alone()) return to_linear(glm::vec3(plan_.shadow->alone(cosine)));
    glm::vec3 colour = surface_colour(hit);
    if (plan_.light) {
      const Light light = light_at(normal, direction, lights_);
      colour = colour * light.diffuse + light.specular;
    }
    return plan_.shadow ? colour * plan_.shadow->shadow(cosine) : colour;
  }

  // Where a surface has no normal it is lit as if it faced the viewer.
  glm::vec3 facing(std::size_t hit, const glm::vec3& direction) const {
    if (scene_.values.normal.empty()) return -direction;
    const glm::vec3 normal = scene_.values.normal[hit];
    const float along = glm::dot(normal, direction);
    if (!std::isfinite(along)) return -direction;
    return along > 0 ? -normal : normal;
  }

  glm::vec3 surface_colour(std::size_t hit) const {
    static const glm::vec3 plain = to_linear({0.93f, 0.84f, 0.72f}), unknown = to_linear(glm::vec3(0.35f));
    if (!plan_.colour) return plain;
    if (plan_.colour->colour) {
      const glm::vec3 colour = plan_.colour->colour(scene_, hit);
      return std::isfinite(colour.x + colour.y + colour.z) ? colour : unknown;
    }
    const float number = scene_.numbers[hit];
    return std::isfinite(number) ? map_(scale_.place(number)) : unknown;
  }

  const Plan& plan_;
  const Scene& scene_;
  Lights lights_;
  ColourMap map_;
  ValueScale scale_;
  std::vector<float> opacities_;
  std::optional<Ink> ink_;
};

// Every pixel is the mean of its samples² rays.
Image develop(const Shader& shader, int width, int height, int samples) {
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * std::size_t(height) * 4, 255)};
  const std::size_t row = std::size_t(width) * std::size_t(samples);
  for (int y = 0; y < height; y++) {
    const glm::vec3 background = shader.background((y + 0.5) / height);
    for (int x = 0; x < width; x++) {
      glm::vec3 sum(0.0f);
      for (int s = 0; s < samples * samples; s++) {
        const std::size_t ray = (std::size_t(y) * std::size_t(samples) + std::size_t(s / samples)) * row +
                                std::size_t(x) * std::size_t(samples) + std::size_t(s % samples);
        sum += shader(ray, background);
      }
      const glm::vec3 display = to_display(sum / float(samples * samples));
      for (int c = 0; c < 3; c++) {
        image.rgba[(std::size_t(y) * std::size_t(width) + std::size_t(x)) * 4 + std::size_t(c)] =
            std::uint8_t(std::lround(255 * display[c]));
      }
    }
  }
  return image;
}

void check(const RenderOptions& options) {
  if (options.camera.width < 1 || options.camera.height < 1) {
    throw Error(ErrorCode::input, fmt::format("a picture of {} x {} pixels; both must be at least 1",
                                              options.camera.width, options.camera.height));
  }
  if (options.samples < 1 || options.samples > 16)
    throw Error(ErrorCode::usage, fmt::format("samples must be 1 to 16, not {}", options.samples));
  if (options.range) {
    const auto [lower, upper] = *options.range;
    if (!std::isfinite(lower) || !std::isfinite(upper) || !(lower < upper)) {
      throw Error(ErrorCode::usage,
                  fmt::format("the range must be two finite numbers, the lower first, not {:g},{:g}", lower, upper));
    }
  }
  // Rays are numbered by 32 bits, and a picture's rays are held at once.
  const double rays = double(options.camera.width) * options.camera.height * options.samples * options.samples;
  constexpr double most = 1u << 28;
  if (rays > most) {
    throw Error(
        ErrorCode::usage,
        fmt::format("{} x {} pixels with {} x {} rays each are {:.0f} rays; at most {:.0f} can be rendered at once",
                    options.camera.width, options.camera.height, options.samples, options.samples, rays, most));
  }
}

}  // namespace

Image render(const Interrogator& query, const RenderOptions& options) {
  const Plan plan = plan_of(options.shades);
  check(options);
  Camera camera = options.camera;
  camera.width *= options.samples;
  camera.height *= options.samples;
  const RayBatch rays = camera.rays();
  const HitList hits = query.cast(rays, {.hits = plan.layers ? Hits::all : Hits::first,
                                         .bad_rays = BadRays::error,
                                         .properties = plan.properties,
                                         .progress = options.progress});
  const PointProperties nothing;
  const PointProperties& values = plan.properties == 0 ? nothing : hits.properties(plan.properties);
  const Scene scene{camera, rays, hits, values,
                    plan.maps_numbers() ? plan.colour->numbers(hits, values) : std::span<const float>()};
  const Shader shader(plan, scene, options);
  Image image = develop(shader, options.camera.width, options.camera.height, options.samples);
  if (hits.size() == 0) {
    write_centred(image, "nothing to see: " + (options.nothing ? options.nothing() : "no ray hits the surface"));
  } else if (options.legend && plan.maps_numbers()) {
    draw_legend(image, shader.map(), shader.scale(), plan.colour->title);
  }
  return image;
}

}  // namespace smurf
