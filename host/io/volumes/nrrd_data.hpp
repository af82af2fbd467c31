// The sample data of an NRRD file, decoded but in the file's byte order.
#pragma once

#include <cstddef>
#include <filesystem>

#include "numerics/input_file.hpp"
#include "smurf/volume.hpp"

namespace smurf {

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
