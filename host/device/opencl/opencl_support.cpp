// OpenCL's codes by name, and the devices of all platforms.
#include "device/opencl/opencl_support.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>

#include "device/device_choice.hpp"
#include "device/executor.hpp"

namespace smurf::opencl {
namespace {

constexpr std::array lane_counts = {16, 8, 4, 1};

// "OpenCL 3.0 PoCL ..." -> {3, 0}
bool at_least_1_2(const std::string& version) {
  int major = 0;
  int minor = 0;
  if (std::sscanf(version.c_str(), "OpenCL %d.%d", &major, &minor) != 2) return false;
  return major > 1 || (major == 1 && minor >= 2);
}

// Some drivers end their strings with zeros or blanks.
std::string trimmed(std::string text) {
  text.resize(std::strlen(text.c_str()));
  text.erase(text.find_last_not_of(" \t\n") + 1);
  text.erase(0, text.find_first_not_of(" \t\n"));
  return text;
}

// Lanes make an OpenCL CPU compiler use its vector units; a GPU runs work items in lockstep by itself.
int preferred_lanes(const cl::Device& device) {
  if (!(device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU)) return 1;
  const int width = static_cast<int>(device.getInfo<CL_DEVICE_PREFERRED_VECTOR_WIDTH_FLOAT>());
  for (const int lanes : lane_counts) {
    if (lanes <= width) return lanes;
  }
  return 1;
}

DeviceInfo describe(const cl::Platform& platform, const cl::Device& device) {
  DeviceInfo info;
  info.executor = "opencl";
  info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  info.platform = fmt::format("{}, {}", trimmed(platform.getInfo<CL_PLATFORM_NAME>()),
                              trimmed(platform.getInfo<CL_PLATFORM_VERSION>()));
  info.memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.largest_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  info.precision = "float";
  info.lanes = preferred_lanes(device);
  info.shares_host_memory =
      device.getInfo<CL_DEVICE_HOST_UNIFIED_MEMORY>() && (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU);
  return info;
}

bool usable(const cl::Device& device) {
  return device.getInfo<CL_DEVICE_AVAILABLE>() && device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() &&
         at_least_1_2(device.getInfo<CL_DEVICE_VERSION>());
}

std::vector<cl::Device> devices_of(const cl::Platform& platform) {
  std::vector<cl::Device> devices;
  try {
    platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
  } catch (const cl::Error&) {
    devices.clear();  // a platform without devices, or whose driver cannot start here
  }
  return devices;
}

int requested_lanes(const DeviceOptions& options) {
  std::string text;
  std::string origin = "DeviceOptions::lanes";
  int lanes = options.lanes;
  if (const char* environment = std::getenv("SMURF_LANES"); lanes == 0 && environment && *environment) {
    const std::string_view value = environment;
    const auto [end, failure] = std::from_chars(value.data(), value.data() + value.size(), lanes);
    if (failure != std::errc{} || end != value.data() + value.size()) lanes = -1;
    text = value;
    origin = "SMURF_LANES";
  } else {
    text = std::to_string(lanes);
  }
  if (lanes != 0 && std::find(lane_counts.begin(), lane_counts.end(), lanes) == lane_counts.end()) {
    throw Error(ErrorCode::usage,
                fmt::format("{} is \"{}\"; it can be 1, 4, 8 or 16, or 0 for the device's choice", origin, text));
  }
  return lanes;
}

}  // namespace

std::string code_name(cl_int code) {
  struct Name {
    cl_int code;
    const char* text;
  };
#define SMURF_CODE(name) \
  Name { name, #name }
  static const std::vector<Name> names = {
      SMURF_CODE(CL_DEVICE_NOT_FOUND),
      SMURF_CODE(CL_DEVICE_NOT_AVAILABLE),
      SMURF_CODE(CL_COMPILER_NOT_AVAILABLE),
      SMURF_CODE(CL_MEM_OBJECT_ALLOCATION_FAILURE),
      SMURF_CODE(CL_OUT_OF_RESOURCES),
      SMURF_CODE(CL_OUT_OF_HOST_MEMORY),
      SMURF_CODE(CL_PROFILING_INFO_NOT_AVAILABLE),
      SMURF_CODE(CL_MEM_COPY_OVERLAP),
      SMURF_CODE(CL_BUILD_PROGRAM_FAILURE),
      SMURF_CODE(CL_MAP_FAILURE),
      SMURF_CODE(CL_MISALIGNED_SUB_BUFFER_OFFSET),
      SMURF_CODE(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST),
      SMURF_CODE(CL_COMPILE_PROGRAM_FAILURE),
      SMURF_CODE(CL_LINKER_NOT_AVAILABLE),
      SMURF_CODE(CL_LINK_PROGRAM_FAILURE),
      SMURF_CODE(CL_KERNEL_ARG_INFO_NOT_AVAILABLE),
      SMURF_CODE(CL_INVALID_VALUE),
      SMURF_CODE(CL_INVALID_DEVICE_TYPE),
      SMURF_CODE(CL_INVALID_PLATFORM),
      SMURF_CODE(CL_INVALID_DEVICE),
      SMURF_CODE(CL_INVALID_CONTEXT),
      SMURF_CODE(CL_INVALID_QUEUE_PROPERTIES),
      SMURF_CODE(CL_INVALID_COMMAND_QUEUE),
      SMURF_CODE(CL_INVALID_HOST_PTR),
      SMURF_CODE(CL_INVALID_MEM_OBJECT),
      SMURF_CODE(CL_INVALID_BINARY),
      SMURF_CODE(CL_INVALID_BUILD_OPTIONS),
      SMURF_CODE(CL_INVALID_PROGRAM),
      SMURF_CODE(CL_INVALID_PROGRAM_EXECUTABLE),
      SMURF_CODE(CL_INVALID_KERNEL_NAME),
      SMURF_CODE(CL_INVALID_KERNEL_DEFINITION),
      SMURF_CODE(CL_INVALID_KERNEL),
      SMURF_CODE(CL_INVALID_ARG_INDEX),
      SMURF_CODE(CL_INVALID_ARG_VALUE),
      SMURF_CODE(CL_INVALID_ARG_SIZE),
      SMURF_CODE(CL_INVALID_KERNEL_ARGS),
      SMURF_CODE(CL_INVALID_WORK_DIMENSION),
      SMURF_CODE(CL_INVALID_WORK_GROUP_SIZE),
      SMURF_CODE(CL_INVALID_WORK_ITEM_SIZE),
      SMURF_CODE(CL_INVALID_GLOBAL_OFFSET),
      SMURF_CODE(CL_INVALID_EVENT_WAIT_LIST),
      SMURF_CODE(CL_INVALID_EVENT),
      SMURF_CODE(CL_INVALID_OPERATION),
      SMURF_CODE(CL_INVALID_BUFFER_SIZE),
      SMURF_CODE(CL_INVALID_GLOBAL_WORK_SIZE),
      SMURF_CODE(CL_INVALID_PROPERTY),
      SMURF_CODE(CL_INVALID_COMPILER_OPTIONS),
      SMURF_CODE(CL_INVALID_LINKER_OPTIONS),
      Name{-1001, "CL_PLATFORM_NOT_FOUND_KHR"},
  };
#undef SMURF_CODE
  for (const Name& name : names) {
    if (name.code == code) return fmt::format("{} ({})", name.text, code);
  }
  return fmt::format("OpenCL code {}", code);
}

Error translated(const cl::Error& error, std::string_view doing) {
  const bool memory = error.err() == CL_MEM_OBJECT_ALLOCATION_FAILURE || error.err() == CL_OUT_OF_HOST_MEMORY;
  return Error(memory ? ErrorCode::memory : ErrorCode::device,
               fmt::format("{}: {} failed with {}", doing, error.what(), code_name(error.err())));
}

std::vector<FoundDevice> find_devices() {
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return {};  // no driver is installed
  }
  std::vector<FoundDevice> found;
  for (const cl::Platform& platform : platforms) {
    for (const cl::Device& device : devices_of(platform)) {
      try {
        if (!usable(device)) continue;
        found.push_back({platform, device, describe(platform, device)});
        found.back().info.index = static_cast<int>(found.size()) - 1;
      } catch (const cl::Error&) {
        // A device that cannot even say what it is cannot run queries.
      }
    }
  }
  return found;
}

FoundDevice choose_device(std::string_view which, const DeviceOptions& options) {
  const int lanes = requested_lanes(options);
  std::vector<FoundDevice> devices = find_devices();
  std::vector<DeviceInfo> infos;
  std::string available;
  for (const FoundDevice& found : devices) {
    infos.push_back(found.info);
    available += fmt::format("{}opencl:{} ({})", available.empty() ? "" : ", ", found.info.index, found.info.name);
  }
  // PoCL is the implementation that the kernels are tuned on, so it comes first where nothing was asked for.
  const DeviceInfo* chosen = which.empty() ? find_device(infos, "PoCL") : nullptr;
  if (!chosen) chosen = find_device(infos, which);
  if (!chosen) {
    throw Error(ErrorCode::usage,
                available.empty() ? std::string("there is no OpenCL device on this machine")
                                  : fmt::format("there is no OpenCL device \"{}\"; available: {}", which, available));
  }
  FoundDevice result = devices[static_cast<std::size_t>(chosen->index)];
  if (lanes != 0) result.info.lanes = lanes;
  return result;
}

}  // namespace smurf::opencl

namespace smurf {

std::vector<DeviceInfo> list_opencl() {
  std::vector<DeviceInfo> infos;
  for (opencl::FoundDevice& found : opencl::find_devices()) infos.push_back(std::move(found.info));
  return infos;
}

}  // namespace smurf
