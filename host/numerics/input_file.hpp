// Input files of which parts are read.
#pragma once

#include <cstddef>
#include <filesystem>

namespace smurf {

// A regular file, open for reading.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& file);  // throws Error (input) that names the file
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::size_t size() const { return size_; }
  int descriptor() const { return descriptor_; }
  void read_at(std::size_t offset, void* out, std::size_t bytes) const;  // throws Error (input) if there are fewer

 private:
  std::filesystem::path path_;
  std::size_t size_ = 0;
  int descriptor_ = -1;
};

}  // namespace smurf
