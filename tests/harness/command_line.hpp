// The program `smurf`, run as a user runs it, for tests: each has an empty folder to itself.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace smurf::test {

struct Outcome {
  int code = -1;
  std::string out, err;
};

std::string text_of(const std::filesystem::path& file);

// A result table: its header, and its cells as text.
struct Csv {
  std::string header;
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;

  explicit Csv(const std::filesystem::path& file);
  const std::string& text(std::size_t row, const std::string& name) const;
  float number(std::size_t row, const std::string& name) const;
};

class CommandLine : public testing::Test {
 protected:
  void SetUp() override;

  void write(const std::string& name, std::string_view bytes) const;
  // A file of the folder, as a word of a command.
  std::string in(const std::string& name) const { return "'" + (folder_ / name).string() + "'"; }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

  // Arguments are given as to a shell.
  Outcome run(const std::string& arguments) const;

  // Refused as bad input: exit code 2, one line that contains every one of `words`, and no new file.
  void expect_refused(const std::string& arguments, const std::vector<std::string>& words) const;

  std::vector<std::string> listing() const;

 private:
  std::filesystem::path folder_;
};

// Whether a device of the executor named first in `device` is there; says so loudly if not.
bool has_device(const std::string& device);

// For test suites that run on every device: values, and their names.
constexpr const char* devices_to_try[] = {"reference", "opencl", "vulkan --validation"};
std::string device_name(const testing::TestParamInfo<const char*>& info);

}  // namespace smurf::test
