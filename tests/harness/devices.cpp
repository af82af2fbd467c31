#include "harness/devices.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <optional>

#include "smurf/error.hpp"

namespace smurf::test {
namespace {

std::vector<TestDevice> open_all() {
  std::vector<TestDevice> devices;
  const auto add = [&](const std::string& name, const std::string& label, int lanes, bool slow) {
    try {
      devices.push_back(
          {name, label, lanes, slow, open_device(name, {.lanes = lanes, .validation = name == "vulkan"})});
    } catch (const Error& error) {
      report_missing(label + ": " + error.what());
    }
  };
  for (int lanes : {16, 8, 4, 1}) add("opencl", "opencl, " + std::to_string(lanes) + " lanes", lanes, false);
  add("vulkan", "vulkan", 0, true);
  return devices;
}

// Devices are closed after the last test rather than when the process ends: the Vulkan layers' own globals are gone
// then.
std::optional<std::vector<TestDevice>> opened;
class CloseDevices : public testing::Environment {
  void TearDown() override { opened.reset(); }
};
[[maybe_unused]] const testing::Environment* const close_devices = testing::AddGlobalTestEnvironment(new CloseDevices);

}  // namespace

std::vector<TestDevice>& test_devices() {
  if (!opened) opened = open_all();
  return *opened;
}

TestDevice* test_device(const std::string& executor) {
  for (TestDevice& device : test_devices())
    if (device.name == executor) return &device;
  return nullptr;
}

std::vector<TestDevice> one_of_each() {
  std::vector<TestDevice> devices;
  for (const char* executor : {"opencl", "vulkan"})
    if (const TestDevice* device = test_device(executor)) devices.push_back(*device);
  devices.push_back({"reference", "reference", 0, false, reference_device()});
  return devices;
}

Device& reference_device() {
  static Device device = open_device("reference");
  return device;
}

bool in_ci() {
  const char* ci = std::getenv("CI");
  return ci && std::string(ci) == "true";
}

void report_missing(const std::string& what) {
  std::cerr << "\n*** NOT TESTED HERE: " << what << "\n\n";
  if (in_ci()) ADD_FAILURE() << "not tested, which CI does not accept: " << what;
}

}  // namespace smurf::test
