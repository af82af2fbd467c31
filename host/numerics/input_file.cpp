#include "numerics/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "smurf/error.hpp"

namespace smurf {

InputFile::InputFile(const std::filesystem::path& file) : path_(file) {
  const auto refuse = [&](const char* reason) {
    throw Error(ErrorCode::input, fmt::format("cannot read \"{}\": {}", file.string(), reason));
  };
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) refuse(std::strerror(error ? error.value() : ENOENT));
  if (!std::filesystem::is_regular_file(status)) refuse("it is no regular file");  // opening a pipe would wait
  descriptor_ = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) refuse(std::strerror(errno));
  struct stat opened {};
  if (fstat(descriptor_, &opened) == 0) size_ = std::size_t(opened.st_size);
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

void InputFile::read_at(std::size_t offset, void* out, std::size_t bytes) const {
  std::size_t filled = 0;
  while (filled < bytes) {
    const ssize_t got = pread(descriptor_, static_cast<char*>(out) + filled, bytes - filled, off_t(offset + filled));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Error(ErrorCode::input, fmt::format("\"{}\": {}", path_.string(), std::strerror(errno)));
    if (got == 0)
      throw Error(ErrorCode::input, fmt::format("\"{}\": the file ended while it was read", path_.string()));
    filled += std::size_t(got);
  }
}

}  // namespace smurf
