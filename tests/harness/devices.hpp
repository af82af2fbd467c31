// The devices that every case runs on. A device that is missing is said loudly, and fails the test where CI=true.
#pragma once

#include <string>
#include <vector>

#include "smurf/device.hpp"

namespace smurf::test {

struct TestDevice {
  std::string name;   // as open_device takes it
  std::string label;  // "opencl, 16 lanes"
  int lanes = 0;
  bool slow = false;  // asks for smaller batches
  Device device;
};

// OpenCL with 16, 8, 4 and 1 lanes, and Vulkan with validation layers; opened once per process.
std::vector<TestDevice>& test_devices();
// One of each executor, and the reference: for cases that need no variety of lanes.
std::vector<TestDevice> one_of_each();
// The first of them that belongs to an executor, or null where there is none.
TestDevice* test_device(const std::string& executor);
Device& reference_device();

// True where a missing device must fail the test: CI=true.
bool in_ci();
// Says that something cannot run here: a failure in CI, a loud skip elsewhere.
void report_missing(const std::string& what);

}  // namespace smurf::test
