// The OpenCL API as the executor uses it: version 1.2, exceptions turned into smurf::Error, and the devices found.
#pragma once

#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <CL/opencl.hpp>

#include <string>
#include <string_view>
#include <vector>

#include "smurf/device.hpp"
#include "smurf/error.hpp"

namespace smurf::opencl {

// "CL_OUT_OF_RESOURCES (-5)"
std::string code_name(cl_int code);

// The library's exception for one of OpenCL's: which call failed with which code, doing what.
Error translated(const cl::Error& error, std::string_view doing);

template <class Call>
auto guarded(std::string_view doing, Call call) {
  try {
    return call();
  } catch (const cl::Error& error) {
    throw translated(error, doing);
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::memory, std::string(doing) + ": there is not enough memory");
  }
}

struct FoundDevice {
  cl::Platform platform;
  cl::Device device;
  DeviceInfo info;
};

// Every device that can compile and run OpenCL C 1.2, platform by platform; never throws for a missing driver.
std::vector<FoundDevice> find_devices();

// The device that `which` means, with the lanes that the options ask for. Throws Error (usage).
FoundDevice choose_device(std::string_view which, const DeviceOptions& options);

}  // namespace smurf::opencl
