// Rows of CSV, gathered and handed to the file in large pieces. Floats have the fewest digits that read back to the
// same float.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "io/atomic_file.hpp"

namespace smurf {

class CsvWriter {
 public:
  explicit CsvWriter(const std::filesystem::path& file) : file_(file) { buffer_.reserve(capacity + 4096); }

  void put(char c) { buffer_.push_back(c); }
  // As they are, without a look for commas and quotes.
  void put(std::string_view text) { buffer_ += text; }
  void cell(std::uint64_t value) { number(value); }
  void cell(std::uint32_t value) { number(value); }
  void cell(float value) {
    if (std::isnan(value)) buffer_ += "nan";  // without a sign that means nothing
    else number(value);
  }
  void cell(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == text.npos) {
      buffer_ += text;
      return;
    }
    buffer_ += '"';
    for (const char c : text) buffer_.append(c == '"' ? 2 : 1, c);
    buffer_ += '"';
  }
  void end_line() {
    buffer_ += '\n';
    if (buffer_.size() >= capacity) flush();
  }
  void commit() {
    flush();
    file_.commit();
  }

 private:
  static constexpr std::size_t capacity = std::size_t(1) << 20;

  template <class T>
  void number(T value) {
    char digits[32];
    buffer_.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
  }
  void flush() {
    file_.write(buffer_);
    buffer_.clear();
  }

  AtomicFile file_;
  std::string buffer_;
};

}  // namespace smurf
