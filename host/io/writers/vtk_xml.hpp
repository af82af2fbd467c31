// VTK XML, written piece by piece, so that no document is held in memory. Arrays stand inline in base64; the format's
// header word is the number of bytes as UInt64. Words become a String array, which holds them one after another, each
// ended by a zero byte.
//
//   VtkXmlWriter xml("lines.vtp", "PolyData");
//   xml.open("Piece", {{"NumberOfPoints", 2}});
//   xml.open("PointData");
//   xml.array<float>("t", 1, 2, [&](std::size_t i) { return times[i]; });
//   xml.close();
//   ...
//   xml.commit();  // closes what is open
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "io/atomic_file.hpp"

namespace smurf {

class VtkXmlWriter {
 public:
  // Throws Error (io) when the file cannot be written; so does everything below.
  VtkXmlWriter(const std::filesystem::path& file, std::string_view type);

  void open(std::string_view tag, std::initializer_list<std::pair<std::string_view, std::uint64_t>> attributes = {});
  void close();

  // `count` numbers, `components` to a tuple; number(i) is the i-th of them.
  template <class T, class Number>
  void array(std::string_view name, int components, std::size_t count, const Number& number) {
    begin_array(type_name<T>(), name, components, count * sizeof(T));
    for (std::size_t i = 0; i < count; i++) put(T(number(i)));
    end_array();
  }
  // `count` words; word(i) is the i-th of them.
  template <class Word>
  void words(std::string_view name, std::size_t count, const Word& word) {
    std::uint64_t bytes = count;
    for (std::size_t i = 0; i < count; i++) bytes += word(i).size();
    begin_array("String", name, 1, bytes);
    for (std::size_t i = 0; i < count; i++) {
      for (const char c : word(i)) put_byte(static_cast<unsigned char>(c));
      put_byte(0);
    }
    end_array();
  }

  void commit();

 private:
  static constexpr std::size_t capacity = std::size_t(1) << 20;

  template <class T>
  static constexpr const char* type_name() {
    if constexpr (std::is_same_v<T, float>) return "Float32";
    else if constexpr (std::is_same_v<T, std::uint32_t>) return "UInt32";
    else if constexpr (std::is_same_v<T, std::uint64_t>) return "UInt64";
    else {
      static_assert(std::is_same_v<T, std::int64_t>);
      return "Int64";
    }
  }

  void begin_array(std::string_view type, std::string_view name, int components, std::uint64_t bytes);
  void end_array();
  template <class T>
  void put(T value) {
    unsigned char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) put_byte(byte);
  }
  void put_byte(unsigned char byte) {
    group_ = group_ << 8 | byte;
    if (++grouped_ == 3) put_group();
  }
  void put_group();
  void start_line();
  void flush();

  AtomicFile file_;
  std::string text_;
  std::vector<std::string> tags_;  // open ones
  std::uint32_t group_ = 0;        // bytes that are not written yet, three to a group
  int grouped_ = 0;
};

}  // namespace smurf
