#include "cli/properties.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "smurf/error.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

namespace {

struct NamedProperty {
  std::string_view name;
  Property property;
};

constexpr NamedProperty named_properties[] = {
    {"value", Property::value},           {"normal", Property::normal},
    {"gauss", Property::gauss},           {"mean", Property::mean},
    {"principal", Property::principal},   {"directions", Property::directions},
    {"parameters", Property::parameters}, {"location", Property::location},
    {"distance", Property::distance},     {"inside", Property::inside},
};

std::string_view reason(Property property) {
  if (property == Property::parameters || property == Property::location) return ", which has no surface coordinates";
  if (property == Property::inside) return ", which encloses nothing";
  if (property == Property::value) return ", which is no level set of a field";
  return "";
}

[[noreturn]] void throw_unknown(std::string_view name) {
  if (name == "normal_curvature" || name == "normal-curvature") {
    throw Error(
        ErrorCode::usage,
        fmt::format(
            "property \"{}\" is not valid here: it needs a direction at each point; ask for principal,directions",
            name));
  }
  std::string known;
  for (const NamedProperty& candidate : named_properties)
    known += fmt::format("{}{}", known.empty() ? "" : ", ", candidate.name);
  throw Error(ErrorCode::usage, fmt::format("unknown property \"{}\"; known are {}", name, known));
}

Property property_named(std::string_view name, const Surface& surface) {
  for (const NamedProperty& candidate : named_properties) {
    if (candidate.name != name) continue;
    if (!contains(surface.model().properties(), candidate.property)) {
      throw Error(ErrorCode::usage, fmt::format("property \"{}\" is not valid for the kind \"{}\"{}", name,
                                                surface.kind(), reason(candidate.property)));
    }
    return candidate.property;
  }
  throw_unknown(name);
}

}  // namespace

std::vector<Property> properties_named(std::string_view list, const Surface& surface) {
  std::vector<Property> properties;
  for (std::size_t start = 0; !list.empty() && start <= list.size();) {
    const std::size_t end = std::min(list.find(',', start), list.size());
    const Property property = property_named(list.substr(start, end - start), surface);
    if (std::find(properties.begin(), properties.end(), property) == properties.end()) properties.push_back(property);
    start = end + 1;
  }
  return properties;
}

std::uint32_t bits_of(const std::vector<Property>& properties) {
  std::uint32_t bits = 0;
  for (const Property property : properties) bits = bits | property;
  return bits;
}

void add_properties(Table& table, const std::vector<Property>& properties, const Surface& surface,
                    const PointProperties& values) {
  for (const Property property : properties) {
    switch (property) {
      case Property::value:
        table.add("value", values.value);
        break;
      case Property::normal:
        table.add({"nx", "ny", "nz"}, values.normal);
        break;
      case Property::gauss:
        table.add("gauss", values.gauss);
        break;
      case Property::mean:
        table.add("mean", values.mean);
        break;
      case Property::principal:
        table.add("k1", values.k1);
        table.add("k2", values.k2);
        break;
      case Property::directions:
        table.add({"d1x", "d1y", "d1z"}, values.d1);
        table.add({"d2x", "d2y", "d2z"}, values.d2);
        break;
      case Property::normal_curvature:
        table.add("normal_curvature", values.normal_curvature);
        break;
      case Property::location:
        table.add({"px", "py", "pz"}, values.location);
        break;
      case Property::distance:
        table.add("distance", values.distance);
        break;
      case Property::inside:
        table.add("inside", values.inside);
        break;
      case Property::parameters:
        table.add(surface.model().coordinate_names(), values.coordinates);
        break;
    }
  }
}

std::string_view point_status_text(std::uint32_t status) {
  static_assert(umbilic == 1 && boundary == 2 && undefined == 4 && crease == 8 && singular == 16);
  static const std::array<std::string, 32> texts = [] {
    constexpr std::array<std::string_view, 5> names = {"umbilic", "boundary", "undefined", "crease", "singular"};
    std::array<std::string, 32> all;
    for (std::size_t bits = 0; bits < all.size(); bits++) {
      for (std::size_t i = 0; i < names.size(); i++) {
        if ((bits >> i & 1) != 0) all[bits].append(all[bits].empty() ? "" : "+").append(names[i]);
      }
    }
    all[0] = "regular";
    return all;
  }();
  return texts[status & 31];
}

}  // namespace smurf
