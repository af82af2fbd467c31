#include "numerics/text_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>

#include "smurf/error.hpp"

namespace smurf {

std::string read_file(const std::filesystem::path& file) {
  const auto fail = [&](const char* reason) {
    throw Error(ErrorCode::input, fmt::format("cannot read \"{}\": {}", file.string(), reason));
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) fail("it is a folder");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), std::fclose);
  if (!stream) fail(std::strerror(errno));
  const auto size = std::filesystem::file_size(file, ignored);
  std::string text(ignored ? 0 : std::size_t(size), '\0');
  std::size_t filled = std::fread(text.data(), 1, text.size(), stream.get());
  text.resize(filled);
  char more[65536];  // pipes have no size, and files may have grown
  while ((filled = std::fread(more, 1, sizeof more, stream.get())) > 0) text.append(more, filled);
  if (std::ferror(stream.get())) fail(std::strerror(errno));
  return text;
}

long double number_beyond_range(std::string_view text) {
  long double value = 0;
  const auto error = std::from_chars(text.data(), text.data() + text.size(), value).ec;
  if (error == std::errc()) return value;
  const bool tiny = text.find("e-") != text.npos || text.find("E-") != text.npos;
  const long double magnitude = tiny ? 0.0L : std::numeric_limits<long double>::infinity();
  return text.front() == '-' ? -magnitude : magnitude;
}

}  // namespace smurf
