// Opacity by curvature: all layers of a ray, composited from front to back; where the surface is flat it is glass,
// where it is curved it hides what lies behind. Opacity grows with curvedness, sqrt((k1² + k2²)/2), and is full at
// what 95 of 100 hits do not exceed.
#include <algorithm>
#include <cmath>

#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

constexpr float least = 0.1f;

std::vector<float> opacities(const Scene& scene) {
  std::vector<float> values(scene.hits.size());
  for (std::size_t i = 0; i < values.size(); i++) values[i] = curvedness(scene.values, i);
  const float full = usual_greatest(values);
  for (float& value : values)
    value = std::isfinite(value) && full > 0 ? least + (1 - least) * std::min(1.0f, value / full) : least;
  return values;
}

}  // namespace

const Technique curvature_opacity{
    .role = Role::layers, .properties = Property::normal | Property::principal, .opacity = opacities};

}  // namespace smurf::techniques
