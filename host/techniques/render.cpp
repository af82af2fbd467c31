// Renders by casting one batch of first hits and shading what was hit, in linear light.
//
// Every pixel has samples² rays on a regular grid, which are those of a camera with samples times the pixels.
#include "smurf/render.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "smurf/error.hpp"
#include "techniques/colour_map.hpp"
#include "techniques/legend.hpp"

namespace smurf {

namespace {

struct NamedShade {
  Shade shade;
  std::string_view name;
  std::string_view title;  // of the legend; empty: no colour map
  std::uint32_t properties;
};

constexpr NamedShade shade_table[] = {
    {Shade::phong, "phong", "", std::uint32_t(Property::normal)},
    {Shade::contour, "contour", "", std::uint32_t(Property::normal)},
    {Shade::normal, "normal", "", std::uint32_t(Property::normal)},
    {Shade::gauss, "gauss", "gauss curvature", std::uint32_t(Property::gauss)},
    {Shade::mean, "mean", "mean curvature", std::uint32_t(Property::mean)},
    {Shade::k1, "k1", "curvature k1", std::uint32_t(Property::principal)},
    {Shade::k2, "k2", "curvature k2", std::uint32_t(Property::principal)},
    {Shade::depth, "depth", "depth", 0},
};

const NamedShade& entry_of(Shade shade) {
  for (const NamedShade& entry : shade_table) {
    if (entry.shade == shade) return entry;
  }
  throw Error(ErrorCode::usage, "not a shade");
}

bool is_colour(Shade shade) { return shade != Shade::phong && shade != Shade::contour; }

// A list of shades, sorted out.
struct Plan {
  bool light = false;
  bool contour = false;
  std::optional<Shade> colour;
  std::uint32_t properties = 0;

  bool maps_numbers() const { return colour && !entry_of(*colour).title.empty(); }
  bool contour_alone() const { return contour && !light && !colour; }
};

Plan plan_of(std::span<const Shade> shades) {
  if (shades.empty()) throw Error(ErrorCode::usage, "the list of shades is empty");
  Plan plan;
  for (const Shade shade : shades) {
    plan.properties |= entry_of(shade).properties;
    plan.light |= shade == Shade::phong;
    plan.contour |= shade == Shade::contour;
    if (!is_colour(shade)) continue;
    if (plan.colour && *plan.colour != shade) {
      throw Error(ErrorCode::usage, fmt::format("the shades {} and {} both decide the colour; name one of them, with "
                                                "phong or contour beside it if wanted",
                                                name_of(*plan.colour), name_of(shade)));
    }
    plan.colour = shade;
  }
  return plan;
}

// What the hits of the batch look like to the shader; spans of the columns that the plan asked for.
struct Columns {
  std::span<const glm::vec3> normals;
  std::span<const float> numbers;  // of the quantity that is mapped to colours
};

Columns columns_of(const HitList& hits, const Plan& plan) {
  Columns columns;
  if (plan.colour == Shade::depth) columns.numbers = hits.t();
  if (plan.properties == 0) return columns;
  const PointProperties& values = hits.properties(plan.properties);
  columns.normals = values.normal;
  if (!plan.colour) return columns;
  switch (*plan.colour) {
    case Shade::gauss:
      columns.numbers = values.gauss;
      break;
    case Shade::mean:
      columns.numbers = values.mean;
      break;
    case Shade::k1:
      columns.numbers = values.k1;
      break;
    case Shade::k2:
      columns.numbers = values.k2;
      break;
    default:
      break;
  }
  return columns;
}

// Up to two digits, so that the numbers of a legend are short.
double rounded_up(double x) {
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 1);
  return std::ceil(x / unit - 1e-9) * unit;
}

ValueRange range_of(std::vector<float> numbers, Shade colour) {
  std::erase_if(numbers, [](float x) { return !std::isfinite(x); });
  if (numbers.empty()) return {-1, 1};
  if (colour == Shade::depth) {
    const auto [least, greatest] = std::minmax_element(numbers.begin(), numbers.end());
    return *least < *greatest ? ValueRange{*least, *greatest} : ValueRange{*least - 0.5, *least + 0.5};
  }
  for (float& x : numbers) x = std::abs(x);
  const auto place = numbers.begin() + std::ptrdiff_t(0.95 * double(numbers.size() - 1));
  std::nth_element(numbers.begin(), place, numbers.end());
  if (!(*place > std::numeric_limits<float>::min())) return {-1, 1};  // flat: all in the middle of the map
  const double bound = rounded_up(*place);
  return {-bound, bound};
}

// Directions to the lights, fixed to the camera.
struct Lights {
  glm::vec3 key, up;
};

Lights lights_of(const Camera& camera) {
  const glm::dvec3 back = glm::normalize(camera.eye - camera.look_at);
  const glm::dvec3 right = glm::normalize(glm::cross(camera.up, back));
  const glm::dvec3 up = glm::cross(back, right);
  return {glm::vec3(glm::normalize(-0.55 * right + 0.75 * up + back)), glm::vec3(up)};
}

struct Light {
  float diffuse;
  float specular;
};

Light light_at(const glm::vec3& normal, const glm::vec3& direction, const Lights& lights) {
  const float head = std::max(0.0f, -glm::dot(normal, direction));
  const float key = std::max(0.0f, glm::dot(normal, lights.key));
  const float ambient = 0.09f + 0.05f * glm::dot(normal, lights.up);  // more from above
  const glm::vec3 halfway = glm::normalize(lights.key - direction);
  const float gloss = std::pow(std::max(0.0f, glm::dot(normal, halfway)), 28.0f);
  return {ambient + 0.30f * head + 0.62f * key, 0.16f * gloss * std::min(1.0f, 4 * key)};
}

// Surfaces turned away from the viewer by more than this cosine are contours.
constexpr float contour_threshold = 0.6f;

float square(float x) { return x * x; }

class Shader {
 public:
  Shader(const Plan& plan, const Columns& columns, const RenderOptions& options)
      : plan_(plan),
        columns_(columns),
        lights_(lights_of(options.camera)),
        map_(plan.colour == Shade::depth ? ColourScale::sequential : ColourScale::diverging),
        scale_(options.range         ? *options.range
               : plan.maps_numbers() ? range_of({columns.numbers.begin(), columns.numbers.end()}, *plan.colour)
                                     : ValueRange{0, 1}) {}

  const ColourMap& map() const { return map_; }
  const ValueScale& scale() const { return scale_; }

  glm::vec3 background(double height) const {  // 0 at the top, 1 at the bottom
    if (plan_.contour_alone()) return glm::vec3(0.0f);
    return backdrop(height);
  }

  glm::vec3 operator()(std::size_t hit, const glm::vec3& direction) const {
    const glm::vec3 normal = facing(hit, direction);
    const float cosine = -glm::dot(normal, direction);
    if (plan_.contour_alone()) return to_linear(glm::vec3(cosine < contour_threshold ? 1 - cosine : 0));
    glm::vec3 colour = colour_of(hit);
    if (plan_.light) {
      const Light light = light_at(normal, direction, lights_);
      colour = colour * light.diffuse + light.specular;
    }
    // Over a colour the rule's jump at the threshold would be a line of its own; outlines set in softly instead.
    if (plan_.contour) colour *= 1 - square(std::max(0.0f, 1 - cosine / contour_threshold));
    return colour;
  }

 private:
  // Where a surface has no normal it is lit as if it faced the viewer.
  glm::vec3 facing(std::size_t hit, const glm::vec3& direction) const {
    if (columns_.normals.empty()) return -direction;
    const glm::vec3 normal = columns_.normals[hit];
    const float along = glm::dot(normal, direction);
    if (!std::isfinite(along)) return -direction;
    return along > 0 ? -normal : normal;
  }

  glm::vec3 colour_of(std::size_t hit) const {
    static const glm::vec3 plain = to_linear({0.93f, 0.84f, 0.72f}), unknown = to_linear(glm::vec3(0.35f));
    if (!plan_.colour) return plain;
    if (*plan_.colour == Shade::normal) {
      const glm::vec3 normal = columns_.normals[hit];
      return std::isfinite(normal.x + normal.y + normal.z) ? to_linear(0.5f * (normal + 1.0f)) : unknown;
    }
    const float number = columns_.numbers[hit];
    return std::isfinite(number) ? map_(scale_.place(number)) : unknown;
  }

  const Plan& plan_;
  const Columns& columns_;
  Lights lights_;
  ColourMap map_;
  ValueScale scale_;
};

// Every pixel is the mean of its samples² rays.
Image develop(const HitList& hits, const RayBatch& rays, const Shader& shader, int width, int height, int samples) {
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * std::size_t(height) * 4, 255)};
  const auto dx = rays.component(RayBatch::direction_x), dy = rays.component(RayBatch::direction_y),
             dz = rays.component(RayBatch::direction_z);
  const auto offsets = hits.offsets();
  const std::size_t row = std::size_t(width) * std::size_t(samples);
  for (int y = 0; y < height; y++) {
    const glm::vec3 background = shader.background((y + 0.5) / height);
    for (int x = 0; x < width; x++) {
      glm::vec3 sum(0.0f);
      for (int s = 0; s < samples * samples; s++) {
        const std::size_t ray = (std::size_t(y) * std::size_t(samples) + std::size_t(s / samples)) * row +
                                std::size_t(x) * std::size_t(samples) + std::size_t(s % samples);
        sum += offsets[ray] == offsets[ray + 1] ? background : shader(offsets[ray], {dx[ray], dy[ray], dz[ray]});
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

std::string_view name_of(Shade shade) { return entry_of(shade).name; }

std::vector<Shade> shades_named(std::string_view list) {
  std::vector<Shade> shades;
  for (std::size_t start = 0; start <= list.size();) {
    const std::size_t end = std::min(list.find(',', start), list.size());
    const std::string_view name = list.substr(start, end - start);
    const auto found = std::find_if(std::begin(shade_table), std::end(shade_table),
                                    [name](const NamedShade& entry) { return entry.name == name; });
    if (found == std::end(shade_table)) {
      std::string known;
      for (const NamedShade& entry : shade_table) known += fmt::format("{}{}", known.empty() ? "" : ", ", entry.name);
      throw Error(ErrorCode::usage, fmt::format("unknown shade \"{}\"; known are {}", name, known));
    }
    shades.push_back(found->shade);
    start = end + 1;
  }
  plan_of(shades);
  return shades;
}

Image render(const Interrogator& query, const RenderOptions& options) {
  const Plan plan = plan_of(options.shades);
  check(options);
  Camera camera = options.camera;
  camera.width *= options.samples;
  camera.height *= options.samples;
  const RayBatch rays = camera.rays();
  const HitList hits = query.cast(
      rays,
      {.hits = Hits::first, .bad_rays = BadRays::error, .properties = plan.properties, .progress = options.progress});
  const Columns columns = columns_of(hits, plan);
  const Shader shader(plan, columns, options);
  Image image = develop(hits, rays, shader, options.camera.width, options.camera.height, options.samples);
  if (options.legend && plan.maps_numbers())
    draw_legend(image, shader.map(), shader.scale(), entry_of(*plan.colour).title);
  return image;
}

}  // namespace smurf
