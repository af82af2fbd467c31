#include "harness/command_line.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "harness/devices.hpp"
#include "smurf/device.hpp"

namespace smurf::test {

namespace fs = std::filesystem;

namespace {

std::size_t lines_in(const std::string& text) { return std::size_t(std::ranges::count(text, '\n')); }

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

Csv::Csv(const fs::path& file) {
  std::istringstream stream(text_of(file));
  std::getline(stream, header);
  names = split(header);
  for (std::string line; std::getline(stream, line);) rows.push_back(split(line));
}

const std::string& Csv::text(std::size_t row, const std::string& name) const {
  return rows.at(row).at(std::size_t(std::find(names.begin(), names.end(), name) - names.begin()));
}

float Csv::number(std::size_t row, const std::string& name) const {
  return std::strtof(text(row, name).c_str(), nullptr);
}

void CommandLine::SetUp() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  std::string name = std::string(info->test_suite_name()) + "-" + info->name();
  std::replace(name.begin(), name.end(), '/', '-');
  folder_ = fs::path(SMURF_TEST_OUTPUT) / "cli" / name;
  fs::remove_all(folder_);
  fs::create_directories(folder_);
}

void CommandLine::write(const std::string& name, std::string_view bytes) const {
  std::ofstream(folder_ / name, std::ios::binary) << bytes;
}

Outcome CommandLine::run(const std::string& arguments) const {
  const std::string out = in("stdout.txt"), err = in("stderr.txt");
  const int status = std::system(("'" SMURF_PROGRAM "' " + arguments + " >" + out + " 2>" + err).c_str());
  Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(file("stdout.txt")),
                  text_of(file("stderr.txt"))};
  fs::remove(file("stdout.txt"));
  fs::remove(file("stderr.txt"));
  return outcome;
}

void CommandLine::expect_refused(const std::string& arguments, const std::vector<std::string>& words) const {
  SCOPED_TRACE(arguments);
  const auto before = listing();
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.code, 2) << outcome.err;
  EXPECT_EQ(lines_in(outcome.err), 1u) << outcome.err;
  EXPECT_TRUE(outcome.err.starts_with("smurf: ")) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  for (const std::string& word : words)
    EXPECT_NE(outcome.err.find(word), std::string::npos) << word << " is not in: " << outcome.err;
  EXPECT_EQ(listing(), before);
}

std::vector<std::string> CommandLine::listing() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) names.push_back(entry.path().string());
  std::sort(names.begin(), names.end());
  return names;
}

bool has_device(const std::string& device) {
  const std::string executor = device.substr(0, device.find(' '));
  for (const DeviceInfo& info : list_devices())
    if (info.executor == executor) return true;
  report_missing(executor);
  return false;
}

std::string device_name(const testing::TestParamInfo<const char*>& info) {
  const std::string name = info.param;
  return name.substr(0, name.find(' '));
}

}  // namespace smurf::test
