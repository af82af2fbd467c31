// Files that a test writes and reads, in a folder of its own.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace smurf::test {

// The folder of the test that runs.
inline std::filesystem::path test_folder() {
  const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
  std::filesystem::path folder =
      std::filesystem::path(SMURF_TEST_OUTPUT) / "files" / test.test_suite_name() / test.name();
  std::filesystem::create_directories(folder);
  return folder;
}

// Names are relative to the test's folder. Removed first: where a file is truncated and written anew, file systems wait
// for the disk.
inline std::filesystem::path put(const std::filesystem::path& name, const std::string& bytes) {
  std::filesystem::path file = test_folder() / name;
  std::filesystem::remove(file);
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

inline std::string get(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

constexpr int wbits_zlib = 15, wbits_gzip = 15 + 16;

// Compressed, in the format that `wbits` names.
inline std::string packed(const std::string& bytes, int wbits) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, wbits, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

}  // namespace smurf::test
