// A list of shades, sorted out.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "techniques/technique.hpp"

namespace smurf {

struct Plan {
  bool light = false;
  const Technique* colour = nullptr;
  const Technique* shadow = nullptr;
  const Technique* layers = nullptr;
  std::vector<const Technique*> marks;
  std::uint32_t properties = 0;

  bool maps_numbers() const { return colour && colour->numbers; }
  bool shadow_alone() const { return shadow && !light && !colour; }
};

// Throws Error (usage) on an empty list, and on lists with two colours.
Plan plan_of(std::span<const Shade> shades);

}  // namespace smurf
