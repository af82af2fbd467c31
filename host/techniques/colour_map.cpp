// Moreland's diverging map is made from its definition: interpolation in Msh, the polar form of CIELAB,
// from a cool to a warm end through white, so that lightness peaks in the middle and bends nowhere.
#include "techniques/colour_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace smurf {

namespace {

constexpr int table_size = 257;  // odd: the middle of a diverging map is an entry

const glm::dvec3 white_point{0.95047, 1.0, 1.08883};  // D65

// Rec. 709 primaries to CIE XYZ; columns are the primaries.
const glm::dmat3 xyz_of_rgb{0.4124564, 0.2126729, 0.0193339, 0.3575761, 0.7151522,
                            0.1191920, 0.1804375, 0.0721750, 0.9503041};

double lab_curve(double x) { return x > 0.008856 ? std::cbrt(x) : 7.787 * x + 16.0 / 116.0; }
double lab_curve_inverse(double y) { return y > 0.206893 ? y * y * y : (y - 16.0 / 116.0) / 7.787; }

glm::dvec3 lab_of_linear(const glm::dvec3& rgb) {
  const glm::dvec3 xyz = xyz_of_rgb * rgb / white_point;
  const double x = lab_curve(xyz.x), y = lab_curve(xyz.y), z = lab_curve(xyz.z);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

glm::dvec3 linear_of_lab(const glm::dvec3& lab) {
  const double y = (lab.x + 16.0) / 116.0, x = y + lab.y / 500.0, z = y - lab.z / 200.0;
  const glm::dvec3 xyz = glm::dvec3(lab_curve_inverse(x), lab_curve_inverse(y), lab_curve_inverse(z)) * white_point;
  return glm::clamp(glm::inverse(xyz_of_rgb) * xyz, 0.0, 1.0);
}

// M is the distance from black, s the angle from the grey axis, h the hue.
struct Msh {
  double m, s, h;
};

Msh msh_of_lab(const glm::dvec3& lab) {
  const double m = glm::length(lab);
  return {m, m > 0 ? std::acos(lab.x / m) : 0.0, std::atan2(lab.z, lab.y)};
}

glm::dvec3 lab_of_msh(const Msh& c) {
  return {c.m * std::cos(c.s), c.m * std::sin(c.s) * std::cos(c.h), c.m * std::sin(c.s) * std::sin(c.h)};
}

// The hue with which white is approached: turned a little, so that the change of hue is not felt as sudden.
double spun_hue(const Msh& saturated, double unsaturated_m) {
  if (saturated.m >= unsaturated_m) return saturated.h;
  const double spin = saturated.s * std::sqrt(unsaturated_m * unsaturated_m - saturated.m * saturated.m) /
                      (saturated.m * std::sin(saturated.s));
  return saturated.h > -std::numbers::pi / 3 ? saturated.h + spin : saturated.h - spin;
}

glm::dvec3 diverging(double x) {
  static const Msh cool = msh_of_lab(lab_of_linear(to_linear(glm::vec3(59, 76, 192) / 255.0f)));
  static const Msh warm = msh_of_lab(lab_of_linear(to_linear(glm::vec3(180, 4, 38) / 255.0f)));
  const double middle_m = std::max({cool.m, warm.m, 88.0});
  const Msh& end = x < 0.5 ? cool : warm;
  const double whiteness = 1 - std::abs(2 * x - 1);
  const double hue = spun_hue(end, middle_m);
  return linear_of_lab(lab_of_msh(
      {std::lerp(end.m, middle_m, whiteness), std::lerp(end.s, 0.0, whiteness), std::lerp(end.h, hue, whiteness)}));
}

glm::dvec3 sequential(double x) {
  return linear_of_lab({std::lerp(95.0, 18.0, x), std::lerp(0.0, 2.0, x), std::lerp(4.0, -22.0, x)});
}

glm::dvec3 viridis(double x) {
  static const std::array<glm::dvec3, 5> lab = [] {
    std::array<glm::dvec3, 5> keys{{{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
    for (glm::dvec3& key : keys) key = lab_of_linear(to_linear(glm::vec3(key / 255.0)));
    return keys;
  }();
  const auto below = std::min(std::size_t(4 * x), lab.size() - 2);
  return linear_of_lab(glm::mix(lab[below], lab[below + 1], 4 * x - double(below)));
}

glm::dvec3 colour_on(ColourScale scale, double x) {
  switch (scale) {
    case ColourScale::diverging:
      return diverging(x);
    case ColourScale::sequential:
      return sequential(x);
    case ColourScale::viridis:
      break;
  }
  return viridis(x);
}

}  // namespace

glm::vec3 to_linear(const glm::vec3& display) {
  const auto channel = [](float v) { return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f); };
  return {channel(display.x), channel(display.y), channel(display.z)};
}

glm::vec3 to_display(const glm::vec3& linear) {
  const auto channel = [](float v) {
    v = std::clamp(v, 0.0f, 1.0f);
    return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
  };
  return {channel(linear.x), channel(linear.y), channel(linear.z)};
}

glm::vec3 backdrop(double height) {
  static const glm::vec3 top = to_linear({0.78f, 0.83f, 0.89f}), bottom = to_linear({0.97f, 0.97f, 0.96f});
  return glm::mix(top, bottom, float(height));
}

ColourMap::ColourMap(ColourScale scale) {
  table_.reserve(table_size);
  for (int i = 0; i < table_size; i++) {
    const double x = double(i) / (table_size - 1);
    table_.emplace_back(colour_on(scale, x));
  }
}

glm::vec3 ColourMap::operator()(double x) const {
  const double place = (x > 0 ? std::min(x, 1.0) : 0.0) * (table_size - 1);  // 0 also for NaN
  const auto below = std::min(std::size_t(place), std::size_t(table_size - 2));
  return glm::mix(table_[below], table_[below + 1], float(place - double(below)));
}

}  // namespace smurf
