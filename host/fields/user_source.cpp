#include "fields/user_source.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr std::size_t longest_source = std::size_t(1) << 20;

void require(bool fits, const std::string& message) {
  if (!fits) throw Error(ErrorCode::input, message);
}

}  // namespace

void require_user_source(std::string_view source, std::string_view what, std::string_view function,
                         std::string_view signature) {
  require(source.find_first_not_of(" \t\r\n") != source.npos,
          fmt::format("{} is empty; it must define {}", what, signature));
  require(source.size() <= longest_source,
          fmt::format("{} has {} bytes; at most {} are possible", what, source.size(), longest_source));
  require(source.find('\0') == source.npos, fmt::format("{} holds a zero byte; it must be text", what));
  require(source.find(function) != source.npos,
          fmt::format("{} does not define the function {}; it must define {}", what, function, signature));
  for (std::size_t line = 0; line < source.size(); line = std::min(source.find('\n', line), source.size() - 1) + 1) {
    const std::size_t hash = source.find_first_not_of(" \t", line);
    if (hash == source.npos || source[hash] != '#') continue;
    const std::size_t word = source.find_first_not_of(" \t", hash + 1);
    require(word == source.npos || source.compare(word, 7, "include") != 0,
            fmt::format("{} has an #include; all words that it can use are there without one", what));
  }
}

}  // namespace smurf
