// The sample data of an NRRD file, decoded but in the file's byte order.
#pragma once

#include <cstddef>
#include <filesystem>

#include "smurf/volume.hpp"

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

struct NrrdData {
  enum class Encoding { raw, gzip, ascii };
  std::filesystem::path file;
  std::size_t header_bytes = 0;  // where the header ends, when it is in the same file
  Encoding encoding = Encoding::raw;
  std::size_t line_skip = 0;  // lines before the data
  long byte_skip = 0;         // then bytes (of the decoded data for gzip); -1-n: the data ends n bytes before the end
};

// `count` samples in memory from allocate_results. Throws Error (input) that names the file when the data is damaged or
// has another length, Error (memory) when it does not fit. Memory is taken only when the file can hold so much.
void* read_nrrd_data(const NrrdData& data, SampleType type, std::size_t count);

}  // namespace smurf
