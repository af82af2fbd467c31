// Arrays of VTK XML files whose numbers stand inline in base64.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <pugixml.hpp>
#include <string>
#include <vector>

namespace smurf::test {

// The bytes of an array behind its header word, which must tell their number.
inline std::string vtk_bytes(const pugi::xml_node& parent, const char* name) {
  const std::string text = parent.find_child_by_attribute("DataArray", "Name", name).text().get(),
                    digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    word = word << 6 | std::uint32_t(digits.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += char(word >> bits & 255);
  }
  std::uint64_t size = 0;
  if (bytes.size() >= sizeof size) std::memcpy(&size, bytes.data(), sizeof size);
  EXPECT_EQ(size + sizeof size, bytes.size()) << name;
  return bytes.substr(std::min(bytes.size(), sizeof size));
}

template <class T>
std::vector<T> vtk_array(const pugi::xml_node& parent, const char* name) {
  const std::string bytes = vtk_bytes(parent, name);
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(static_cast<void*>(values.data()), bytes.data(), values.size() * sizeof(T));
  return values;
}

}  // namespace smurf::test
