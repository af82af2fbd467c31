// Text files word by word, with line numbers for messages.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf {

class WordReader {
 public:
  // `comment` begins a comment that lasts to the end of its line; '\n' for none. The text must outlive the reader.
  WordReader(const std::filesystem::path& file, std::string_view text, char comment)
      : file_(file), text_(text), comment_(comment) {}

  // The next word of this line; empty at its end.
  std::string_view word_in_line() {
    while (at_ < text_.size() && is_blank(text_[at_])) at_++;
    if (at_ < text_.size() && text_[at_] == comment_ && comment_ != '\n')
      at_ = std::min(text_.find('\n', at_), text_.size());
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] != '\n' && !is_blank(text_[at_]) && text_[at_] != comment_) at_++;
    return text_.substr(begin, at_ - begin);
  }
  // The next word, on whatever line; empty at the end of the file.
  std::string_view word() {
    while (true) {
      const std::string_view found = word_in_line();
      if (!found.empty() || !next_line()) return found;
    }
  }
  // Goes on behind the end of this line; false at the end of the file.
  bool next_line() {
    at_ = std::min(text_.find('\n', at_), text_.size());
    if (at_ == text_.size()) return false;
    at_++;
    line_++;
    return true;
  }
  std::size_t position() const { return at_; }

  [[noreturn]] void fail(const std::string& message) const {
    // Lines that go on, whose ends stand as '\v', count as several.
    const std::size_t line = line_ + std::size_t(std::ranges::count(text_.substr(0, at_), '\v'));
    throw Error(ErrorCode::input, fmt::format("\"{}\", line {}: {}", file_.string(), line, message));
  }

  // `what` says in messages which number it is.
  template <class T>
  T number(std::string_view word, const char* what) const {
    T value{};
    if (word.empty()) fail(fmt::format("{} is missing", what));
    const NumberParse result = parse_number(word, value);
    if (result == NumberParse::not_a_number)
      fail(fmt::format("{} is \"{}\"; it must be {}", what, shown(word),
                       std::is_integral_v<T> ? "a whole number" : "a number"));
    if (result == NumberParse::out_of_range) fail(fmt::format("{} is {}, which is out of range", what, shown(word)));
    return value;
  }

  // For messages: the beginning of the word, in characters that print.
  static std::string shown(std::string_view word) {
    std::string out(word.substr(0, 40));
    std::ranges::replace_if(
        out, [](char c) { return c < ' ' || c > '~'; }, '?');
    return out.size() < word.size() ? out + "..." : out;
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

  const std::filesystem::path& file_;
  std::string_view text_;
  char comment_;
  std::size_t at_ = 0, line_ = 1;
};

}  // namespace smurf
