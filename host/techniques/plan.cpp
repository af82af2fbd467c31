#include "techniques/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "smurf/error.hpp"

namespace smurf {

namespace {

struct NamedShade {
  Shade shade;
  std::string_view name, help;
};

constexpr NamedShade shade_table[] = {
#define SHADE(name, text, help) {Shade::name, text, help},
#include "smurf/shades.def"
#undef SHADE
};

}  // namespace

Plan plan_of(std::span<const Shade> shades) {
  if (shades.empty()) throw Error(ErrorCode::usage, "the list of shades is empty");
  Plan plan;
  std::optional<Shade> colour;
  for (const Shade shade : shades) {
    const Technique& technique = technique_of(shade);
    plan.properties |= technique.properties;
    switch (technique.role) {
      case Role::light:
        plan.light = true;
        break;
      case Role::colour:
        if (colour && *colour != shade) {
          throw Error(ErrorCode::usage,
                      fmt::format("the shades {} and {} both decide the colour; name one of them, with "
                                  "phong, contour and others beside it if wanted",
                                  name_of(*colour), name_of(shade)));
        }
        colour = shade;
        plan.colour = &technique;
        break;
      case Role::shadow:
        plan.shadow = &technique;
        break;
      case Role::mark:
        if (std::ranges::find(plan.marks, &technique) == plan.marks.end()) plan.marks.push_back(&technique);
        break;
      case Role::layers:
        plan.layers = &technique;
        break;
    }
  }
  // Lines and layers need a surface to lie on.
  if (!plan.colour && (plan.layers || !plan.marks.empty())) {
    plan.light = true;
    plan.properties |= std::uint32_t(Property::normal);
  }
  return plan;
}

std::string_view name_of(Shade shade) {
  for (const NamedShade& entry : shade_table) {
    if (entry.shade == shade) return entry.name;
  }
  throw Error(ErrorCode::usage, "not a shade");
}

std::string shades_help() {
  std::string help;
  for (const NamedShade& entry : shade_table)
    help += fmt::format("{}{} ({})", help.empty() ? "" : ", ", entry.name, entry.help);
  return help;
}

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

}  // namespace smurf
