// The contours of Loeffelmann and Groeller (1999, Fig. 6): -d·n < 0.6 ? 1 - (-d·n) : 0, white on black.
// Over other shades the rule's jump at the threshold would be a line of its own; there darkness sets in softly.
#include <algorithm>

#include "techniques/technique.hpp"

namespace smurf::techniques {

namespace {

constexpr float threshold = 0.6f;

float rule(float cosine) { return cosine < threshold ? 1 - cosine : 0; }

float darkened(float cosine) {
  const float beyond = std::max(0.0f, 1 - cosine / threshold);
  return 1 - beyond * beyond;
}

}  // namespace

const Technique contour{
    .role = Role::shadow, .properties = std::uint32_t(Property::normal), .shadow = darkened, .alone = rule};

}  // namespace smurf::techniques
