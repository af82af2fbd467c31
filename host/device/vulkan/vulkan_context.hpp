// A Vulkan device: loader, instance, validation, the choice of the physical device, one compute queue.
//
// The loader is opened at run time, so that the library also loads where there is none.
#pragma once

// The whole back end goes through the function tables of vk::raii; nothing is linked.
#define VK_NO_PROTOTYPES
#define VULKAN_HPP_DISPATCH_LOADER_DYNAMIC 1
#include <fmt/format.h>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "device/vulkan/spirv_compiler.hpp"
#include "smurf/device.hpp"
#include "smurf/error.hpp"

namespace smurf::vulkan {

// What the validation layers said. Drivers and layers may call back from threads of their own.
class Messages {
 public:
  void add(std::string text);
  // Throws Error (device) with what has come in since the last call, if anything has.
  void check();

 private:
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

class Context {
 public:
  // `which`: a number, part of a name, or empty: then the first discrete GPU, else the first device.
  // Throws Error (usage) that lists what there is.
  Context(std::string_view which, const DeviceOptions& options);
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const vk::raii::Device& device() const { return device_; }
  const vk::raii::Queue& queue() const { return queue_; }
  std::uint32_t queue_family() const { return queue_family_; }
  const vk::PhysicalDeviceProperties& properties() const { return properties_; }
  const vk::PhysicalDeviceMemoryProperties& memory() const { return memory_; }
  const FloatControls& float_controls() const { return float_controls_; }
  // The device's memory is the host's: a CPU or an integrated GPU.
  bool is_unified() const;
  // 0 where host memory cannot be imported.
  std::size_t import_alignment() const { return import_alignment_; }
  // Nanoseconds per tick, 0 where the queue has no timestamps; the bits of a timestamp that count.
  double timestamp_period() const { return timestamp_period_; }
  std::uint64_t timestamp_mask() const { return timestamp_mask_; }
  const DeviceInfo& info() const { return info_; }
  void check_messages() const { messages_->check(); }

  // Bytes of this context's allocations per heap; the rest of the heap is taken to be available.
  std::vector<std::size_t> heap_used;

 private:
  void open_device();

  std::unique_ptr<Messages> messages_ = std::make_unique<Messages>();  // outlives the messenger
  vk::raii::Context loader_;
  vk::raii::Instance instance_ = nullptr;
  vk::raii::DebugUtilsMessengerEXT messenger_ = nullptr;
  vk::raii::PhysicalDevice physical_ = nullptr;
  vk::raii::Device device_ = nullptr;
  vk::raii::Queue queue_ = nullptr;
  std::uint32_t queue_family_ = 0;
  vk::PhysicalDeviceProperties properties_;
  vk::PhysicalDeviceMemoryProperties memory_;
  FloatControls float_controls_;
  std::size_t import_alignment_ = 0;
  double timestamp_period_ = 0;
  std::uint64_t timestamp_mask_ = 0;
  DeviceInfo info_;
};

// Devices that can run queries, in the order of their numbers. Empty without loader or driver.
std::vector<DeviceInfo> list_devices();

// Runs f; what Vulkan throws becomes Error (device) that says during what.
template <class F>
auto guarded(std::string_view during, F&& f) -> decltype(f()) {
  try {
    return std::forward<F>(f)();
  } catch (const vk::Error& failure) {
    throw Error(ErrorCode::device, fmt::format("vulkan: {} failed: {}", during, failure.what()));
  }
}

}  // namespace smurf::vulkan
