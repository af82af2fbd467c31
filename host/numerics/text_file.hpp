// Whole input files, and numbers in text, for the readers of this folder.
#pragma once

#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

namespace smurf {

// Throws Error (input) that names the file when it is missing, no regular file or cannot be read.
std::string read_file(const std::filesystem::path& file);

enum class NumberParse { ok, not_a_number, out_of_range };

// A well-formed number that is too great or too small for its type, in a wider one; infinity or zero if that does
// not do.
long double number_beyond_range(std::string_view text);

// The whole of `text` as one number, without regard to the locale. Floating-point numbers are rounded to the
// nearest, beyond the range to infinity or zero; integers out of range are out_of_range.
template <class T>
NumberParse parse_number(std::string_view text, T& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);  // from_chars knows no plus
  const char* end = text.data() + text.size();
  auto [stop, error] = std::from_chars(text.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return NumberParse::not_a_number;
  if (error != std::errc::result_out_of_range) return NumberParse::ok;
  if constexpr (std::is_floating_point_v<T>) {
    value = T(number_beyond_range(text));  // from_chars leaves the value alone
    return NumberParse::ok;
  } else {
    return NumberParse::out_of_range;
  }
}

}  // namespace smurf
