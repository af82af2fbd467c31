// Colours: conversions between display and linear light, and the maps from numbers to colours.
// Colours are linear RGB (Rec. 709 primaries) unless they are called display colours (sRGB).
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace smurf {

glm::vec3 to_linear(const glm::vec3& display);
glm::vec3 to_display(const glm::vec3& linear);

// What is behind everything: light, darker at the top. `height` is 0 at the top of the picture and 1 at the bottom.
glm::vec3 backdrop(double height);

enum class ColourScale { diverging, sequential, viridis };

// A map of [0, 1] to colours, tabulated; values outside take the colour of the nearer end.
//   diverging   cool to warm through a light grey at 1/2 (Moreland, Diverging Color Maps for
//                Scientific Visualization, 2009)
//   sequential  light to dark, by even steps of lightness
//   viridis     dark violet to yellow over blue and green, by even steps of lightness: five colours of the map of that
//               name (Smith, van der Walt 2015), interpolated in CIELAB
class ColourMap {
 public:
  explicit ColourMap(ColourScale scale);
  glm::vec3 operator()(double x) const;

 private:
  std::vector<glm::vec3> table_;
};

}  // namespace smurf
