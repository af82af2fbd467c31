#include "io/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "smurf/error.hpp"

namespace smurf {
namespace {

// The permissions that the finished file gets: those of the file that it replaces, else what umask leaves.
mode_t final_mode(const std::filesystem::path& target) {
  struct stat status {};
  if (stat(target.c_str(), &status) == 0) return status.st_mode & 07777;
  const mode_t mask = umask(0);
  umask(mask);
  return 0666 & ~mask;
}

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& target) : target_(target), resolved_(target) {
  std::error_code ignored;
  const auto status = std::filesystem::status(target, ignored);
  if (target.empty()) fail(ENOENT);
  if (std::filesystem::is_directory(status)) fail(EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    stream_ = std::fopen(target.c_str(), "wb");
    if (stream_ == nullptr) fail(errno);
    return;
  }
  if (std::filesystem::exists(status)) {
    if (access(target.c_str(), W_OK) != 0) fail(errno);       // renaming would replace a write-protected file
    resolved_ = std::filesystem::canonical(target, ignored);  // replace what a link points to, not the link
    if (ignored) resolved_ = target;
  }
  std::string name = resolved_.string() + ".XXXXXX";
  const int descriptor = mkstemp(name.data());
  if (descriptor < 0) fail(errno);
  temporary_ = name;
  const bool ready = fchmod(descriptor, final_mode(resolved_)) == 0 && (stream_ = fdopen(descriptor, "wb")) != nullptr;
  if (!ready) {
    const int error_number = errno;
    close(descriptor);
    std::filesystem::remove(temporary_, ignored);
    fail(error_number);
  }
}

AtomicFile::~AtomicFile() {
  if (stream_ == nullptr) return;
  std::fclose(stream_);
  std::error_code ignored;
  if (!temporary_.empty()) std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) fail(errno);
}

void AtomicFile::commit() {
  const bool flushed =
      std::fflush(stream_) == 0;  // before fclose, so that a full disk leaves the stream to the destructor
  if (!flushed) fail(errno);
  const bool closed = std::fclose(std::exchange(stream_, nullptr)) == 0;
  const bool written = closed && (temporary_.empty() || std::rename(temporary_.c_str(), resolved_.c_str()) == 0);
  if (written) return;
  const int error_number = errno;
  std::error_code ignored;
  if (!temporary_.empty()) std::filesystem::remove(temporary_, ignored);
  fail(error_number);
}

void AtomicFile::fail(int error_number) const {
  throw Error(ErrorCode::io, fmt::format("cannot write \"{}\": {}", target_.string(), std::strerror(error_number)));
}

void write_file(const std::filesystem::path& target, std::string_view bytes) {
  AtomicFile file(target);
  file.write(bytes);
  file.commit();
}

}  // namespace smurf
