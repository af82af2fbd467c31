// Opening devices by name, listing them, and the members of Device.
//
// A name is an executor's, then optionally ':' and a number or part of a name, which the executor
// resolves. The reference is always there and has one device.
#include "smurf/device.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <utility>

#include "device/device_choice.hpp"
#include "device/executor.hpp"
#include "smurf/error.hpp"

namespace smurf {

struct Device::State {
  DeviceInfo info;
  std::unique_ptr<Executor> executor;  // null for the reference
};

namespace {

DeviceInfo reference_info() {
  DeviceInfo info;
  info.executor = "reference";
  info.name = "scalar C++, double precision";
  info.platform = "host";
  info.precision = "double";
  info.shares_host_memory = true;
  const long pages = ::sysconf(_SC_PHYS_PAGES);
  const long page = ::sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0) info.memory = static_cast<std::size_t>(pages) * static_cast<std::size_t>(page);
  return info;
}

std::string what_is_available() {
  std::string text;
  for (const DeviceInfo& info : list_devices()) {
    if (!text.empty()) text += ", ";
    text +=
        info.executor == "reference" ? info.executor : fmt::format("{}:{} ({})", info.executor, info.index, info.name);
  }
  return text;
}

[[noreturn]] void throw_unknown(std::string_view name) {
  throw Error(ErrorCode::usage,
              fmt::format("there is no device \"{}\"; available here: {}", name, what_is_available()));
}

// Opens on an executor. Its complaint about an unknown device is replaced by one that names the devices of
// all executors; other complaints (about options) pass.
template <class Open, class List>
std::unique_ptr<Executor> open_on(std::string_view name, std::string_view which, const DeviceOptions& options,
                                  Open open, List list) {
  try {
    return open(which, options);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::usage && !find_device(list(), which)) throw_unknown(name);
    throw;
  }
}

template <class State>
State& opened(const std::shared_ptr<State>& state) {
  if (!state) throw Error(ErrorCode::usage, "a device must be opened with open_device before it is used");
  return *state;
}

}  // namespace

Device open_device(std::string_view name, const DeviceOptions& options) {
  const auto colon = name.find(':');
  const std::string_view executor = name.substr(0, colon);
  const std::string_view which = colon == std::string_view::npos ? std::string_view{} : name.substr(colon + 1);
  if (colon != std::string_view::npos && which.empty()) throw_unknown(name);

  Device device;
  device.state_ = std::make_shared<Device::State>();
  Device::State& state = *device.state_;
  if (executor == "reference") {
    if (!which.empty() && which != "0") throw_unknown(name);
    state.info = reference_info();
  } else if (executor == "opencl") {
    state.executor = open_on(name, which, options, open_opencl, list_opencl);
  } else if (executor == "vulkan") {
    state.executor = open_on(name, which, options, open_vulkan, list_vulkan);
  } else {
    throw_unknown(name);
  }
  if (state.executor) state.info = state.executor->info();
  return device;
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> devices = list_opencl();
  for (DeviceInfo& info : list_vulkan()) devices.push_back(std::move(info));
  devices.push_back(reference_info());
  return devices;
}

const DeviceInfo& Device::info() const { return opened(state_).info; }

bool Device::is_reference() const { return !opened(state_).executor; }

std::vector<KernelTime> Device::kernel_times() const {
  return is_reference() ? std::vector<KernelTime>{} : state_->executor->kernel_times();
}

double Device::compile_seconds() const { return is_reference() ? 0.0 : state_->executor->compile_seconds; }

std::size_t Device::programs_compiled() const { return is_reference() ? 0 : state_->executor->programs_compiled; }

std::size_t Device::programs_from_cache() const { return is_reference() ? 0 : state_->executor->programs_from_cache; }

Executor& Device::executor() const {
  if (is_reference()) throw Error(ErrorCode::usage, "the reference device has no executor");
  return *state_->executor;
}

}  // namespace smurf
