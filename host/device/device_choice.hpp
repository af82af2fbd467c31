// What follows the colon in a device's name: a number, or part of a device or platform name (case ignored).
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/device.hpp"

namespace smurf {

inline bool contains_ignoring_case(std::string_view text, std::string_view part) {
  const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
  return std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

// The first device that `which` means; null if there is none. Empty means any. Digits alone are always an index.
inline const DeviceInfo* find_device(const std::vector<DeviceInfo>& devices, std::string_view which) {
  const bool number = !which.empty() && which.find_first_not_of("0123456789") == std::string_view::npos;
  const auto meant = [&](const DeviceInfo& info) {
    if (number) return std::string_view(std::to_string(info.index)) == which;
    return contains_ignoring_case(info.name, which) || contains_ignoring_case(info.platform, which);
  };
  const auto found = std::find_if(devices.begin(), devices.end(), meant);
  return found == devices.end() ? nullptr : &*found;
}

}  // namespace smurf
