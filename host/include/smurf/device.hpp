// Devices: where queries run.
//
// A device is named "opencl", "vulkan" or "reference", with an optional ":n" to choose the n-th
// device of that executor, or ":name" to choose the first whose platform or device name contains
// name (case ignored).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace smurf {

class Executor;  // internal: one back end on one device; null for the reference

struct DeviceInfo {
  std::string executor;                // "opencl", "vulkan" or "reference"
  int index = 0;                       // the n of "opencl:n"
  std::string name;                    // the driver's name of the device
  std::string platform;                // platform or driver, with its version
  std::size_t memory = 0;              // bytes of global memory; 0 if unknown
  std::size_t largest_allocation = 0;  // bytes in one buffer; 0 if unlimited
  std::string precision;               // "float" or "double"
  int lanes = 1;                       // rays that one work item handles
  bool shares_host_memory = false;     // buffers can stand on the caller's memory without a copy
};

struct DeviceOptions {
  int lanes = 0;            // 1, 4, 8 or 16 on OpenCL; 0 lets the device's preferred vector width decide
  bool validation = false;  // Vulkan validation layers; any message becomes an Error
  bool timing = false;      // record the time of each kernel (see KernelTime)
};

struct KernelTime {
  std::string kernel;
  std::size_t launches = 0;
  double seconds = 0;
};

// A device on which queries run. Copies share the device. Not to be used by two threads at once.
class Device {
 public:
  const DeviceInfo& info() const;
  bool is_reference() const;

  // Time per kernel since the device was opened; empty unless DeviceOptions::timing.
  std::vector<KernelTime> kernel_times() const;
  // Seconds spent in compiling programs, and how many were compiled or came from the cache.
  double compile_seconds() const;
  std::size_t programs_compiled() const;
  std::size_t programs_from_cache() const;

  Executor& executor() const;  // internal; throws on the reference

 private:
  friend Device open_device(std::string_view, const DeviceOptions&);
  struct State;
  std::shared_ptr<State> state_;
};

// Opens a device by name. Throws Error (usage) that lists what is available when there is none.
Device open_device(std::string_view name = "opencl", const DeviceOptions& options = {});

// All devices that can run queries here; never throws for a missing driver.
std::vector<DeviceInfo> list_devices();

}  // namespace smurf
