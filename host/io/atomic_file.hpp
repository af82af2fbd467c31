// Output files, written whole or not at all: the bytes go to a temporary file beside the target, which
// takes the target's name on commit(). Until then, and on any failure, the target stays as it was.
//
// A target that exists and is no regular file (a pipe, /dev/stdout) is written directly.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace smurf {

class AtomicFile {
 public:
  // Throws Error (io) that names the file and the reason when it cannot be written there.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();  // without commit(): removes the temporary file
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  // Both throw Error (io), for instance when the disk is full.
  void write(std::string_view bytes);
  void commit();

 private:
  void fail(int error_number) const;

  std::filesystem::path target_;     // as the caller named it, for messages
  std::filesystem::path resolved_;   // links followed
  std::filesystem::path temporary_;  // empty when the target is written directly
  std::FILE* stream_ = nullptr;
};

// The same in one call.
void write_file(const std::filesystem::path& target, std::string_view bytes);

}  // namespace smurf
