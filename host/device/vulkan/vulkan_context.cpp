// Opens the loader, an instance with validation on request, and the device that was asked for.
//
// A device is fit when it speaks Vulkan 1.2, has a queue for compute and buffer device addresses; all
// else is asked for at most. Numbers count the fit devices in the loader's order.
#include "device/vulkan/vulkan_context.hpp"

#ifdef __SANITIZE_ADDRESS__
#include <dlfcn.h>
#include <link.h>
#endif
#include <algorithm>
#include <optional>

#include "device/device_choice.hpp"

namespace smurf::vulkan {
namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

VKAPI_ATTR VkBool32 VKAPI_CALL receive_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                               const VkDebugUtilsMessengerCallbackDataEXT* data, void* messages) {
  const char* text = data->pMessage ? data->pMessage : data->pMessageIdName;
  static_cast<Messages*>(messages)->add(text ? text : "message without text");
  return VK_FALSE;
}

vk::DebugUtilsMessengerCreateInfoEXT messenger_for(Messages& messages) {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
  return {{},
          Severity::eWarning | Severity::eError,
          Type::eGeneral | Type::eValidation | Type::ePerformance,
          receive_message,
          &messages};
}

template <class Properties>
bool contains_name(const std::vector<Properties>& all, std::string_view name) {
  return std::any_of(all.begin(), all.end(), [name](const Properties& one) {
    if constexpr (requires { one.layerName; }) {
      return std::string_view(one.layerName.data()) == name;
    } else {
      return std::string_view(one.extensionName.data()) == name;
    }
  });
}

// Leaks of drivers and layers can be told from our own only while their libraries stand in memory, and those that the
// loader has unloaded when the process ends have no names any more.
void keep_libraries() {
#ifdef __SANITIZE_ADDRESS__
  std::vector<std::string> names;
  dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t, void* list) {
        if (library->dlpi_name && *library->dlpi_name)
          static_cast<std::vector<std::string>*>(list)->push_back(library->dlpi_name);
        return 0;
      },
      &names);
  for (const std::string& name : names) dlopen(name.c_str(), RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE);
#endif
}

vk::raii::Instance open_instance(const vk::raii::Context& loader, Messages* validation) {
  const vk::ApplicationInfo application("smurf", 1, "smurf", 1, VK_API_VERSION_1_2);
  if (loader.enumerateInstanceVersion() < VK_API_VERSION_1_2) {
    throw Error(ErrorCode::device, "vulkan: the loader is older than Vulkan 1.2");
  }
  vk::InstanceCreateInfo plain({}, &application);
  if (!validation) return {loader, plain};

  if (!contains_name(loader.enumerateInstanceLayerProperties(), validation_layer)) {
    throw Error(ErrorCode::device, fmt::format("vulkan: validation was asked for, but {} is not installed "
                                               "(Debian's package: vulkan-validationlayers)",
                                               validation_layer));
  }
  const vk::ValidationFeatureEnableEXT synchronization = vk::ValidationFeatureEnableEXT::eSynchronizationValidation;
  const std::vector<const char*> extensions = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                               VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME};
  const vk::StructureChain chain(vk::InstanceCreateInfo({}, &application, validation_layer, extensions),
                                 messenger_for(*validation), vk::ValidationFeaturesEXT(synchronization));
  return {loader, chain.get<vk::InstanceCreateInfo>()};
}

// The first family that computes, by preference one that does not draw.
std::optional<std::uint32_t> compute_family(const vk::raii::PhysicalDevice& device) {
  std::optional<std::uint32_t> found;
  const auto families = device.getQueueFamilyProperties();
  for (std::uint32_t i = 0; i < families.size(); i++) {
    if (!(families[i].queueFlags & vk::QueueFlagBits::eCompute)) continue;
    if (!(families[i].queueFlags & vk::QueueFlagBits::eGraphics)) return i;
    if (!found) found = i;
  }
  return found;
}

bool is_fit(const vk::raii::PhysicalDevice& device) {
  if (device.getProperties().apiVersion < VK_API_VERSION_1_2 || !compute_family(device)) return false;
  const auto features = device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>();
  return features.get<vk::PhysicalDeviceVulkan12Features>().bufferDeviceAddress;
}

std::vector<vk::raii::PhysicalDevice> fit_devices(const vk::raii::Instance& instance) {
  std::vector<vk::raii::PhysicalDevice> fit;
  for (vk::raii::PhysicalDevice& device : instance.enumeratePhysicalDevices()) {
    if (is_fit(device)) fit.push_back(std::move(device));
  }
  return fit;
}

bool can_import(const vk::raii::PhysicalDevice& device) {
  return contains_name(device.enumerateDeviceExtensionProperties(), VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME);
}

bool is_unified_type(vk::PhysicalDeviceType type) {
  return type == vk::PhysicalDeviceType::eCpu || type == vk::PhysicalDeviceType::eIntegratedGpu;
}

DeviceInfo describe(const vk::raii::PhysicalDevice& device, int index) {
  const auto chain = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceVulkan11Properties,
                                           vk::PhysicalDeviceDriverProperties>();
  const vk::PhysicalDeviceProperties& properties = chain.get<vk::PhysicalDeviceProperties2>().properties;
  const auto& driver = chain.get<vk::PhysicalDeviceDriverProperties>();
  DeviceInfo info;
  info.executor = "vulkan";
  info.index = index;
  info.name = properties.deviceName.data();
  info.platform = fmt::format("{} {}, Vulkan {}.{}.{}", driver.driverName.data(), driver.driverInfo.data(),
                              VK_API_VERSION_MAJOR(properties.apiVersion), VK_API_VERSION_MINOR(properties.apiVersion),
                              VK_API_VERSION_PATCH(properties.apiVersion));
  const auto memory = device.getMemoryProperties();
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; i++) {
    if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal) {
      info.memory = std::max(info.memory, std::size_t(memory.memoryHeaps[i].size));
    }
  }
  info.largest_allocation = std::size_t(chain.get<vk::PhysicalDeviceVulkan11Properties>().maxMemoryAllocationSize);
  info.precision = "float";
  info.shares_host_memory = is_unified_type(properties.deviceType) && can_import(device);
  return info;
}

std::optional<std::size_t> choose(const std::vector<vk::raii::PhysicalDevice>& devices, std::string_view which) {
  std::vector<DeviceInfo> infos;
  for (const vk::raii::PhysicalDevice& device : devices) {
    if (which.empty() && device.getProperties().deviceType == vk::PhysicalDeviceType::eDiscreteGpu) return infos.size();
    infos.push_back(describe(device, int(infos.size())));
  }
  const DeviceInfo* chosen = find_device(infos, which);
  return chosen ? std::optional(std::size_t(chosen->index)) : std::nullopt;
}

std::string listing(const std::vector<vk::raii::PhysicalDevice>& devices) {
  std::string text;
  for (std::size_t i = 0; i < devices.size(); i++) {
    text += fmt::format("{}vulkan:{} ({})", i ? ", " : "", i, devices[i].getProperties().deviceName.data());
  }
  return text;
}

vk::raii::Context open_loader() {
  try {
    return {};
  } catch (const std::exception&) {
    throw Error(ErrorCode::usage,
                "vulkan: there is no Vulkan loader here (libvulkan.so.1; Debian's package: libvulkan1)");
  }
}

}  // namespace

void Messages::add(std::string text) {
  const std::lock_guard lock(mutex_);
  texts_.push_back(std::move(text));
}

void Messages::check() {
  const std::lock_guard lock(mutex_);
  if (texts_.empty()) return;
  const std::string first = texts_.front();
  const std::size_t count = texts_.size();
  texts_.clear();
  const std::string more = count > 1 ? fmt::format(" (and {} more messages)", count - 1) : "";
  throw Error(ErrorCode::device, fmt::format("vulkan: validation: {}{}", first, more));
}

Context::Context(std::string_view which, const DeviceOptions& options) : loader_(open_loader()) {
  guarded("opening the device", [&] {
    Messages* validation = options.validation ? messages_.get() : nullptr;
    try {
      instance_ = open_instance(loader_, validation);
    } catch (const vk::IncompatibleDriverError&) {
      throw Error(ErrorCode::usage, "vulkan: there is no Vulkan driver here (Debian's package: mesa-vulkan-drivers)");
    }
    if (validation) messenger_ = vk::raii::DebugUtilsMessengerEXT(instance_, messenger_for(*validation));

    auto devices = fit_devices(instance_);
    const auto chosen = choose(devices, which);
    if (!chosen && devices.empty()) {
      throw Error(ErrorCode::usage, "vulkan: no device here speaks Vulkan 1.2 with buffer device addresses");
    }
    if (!chosen) {
      throw Error(ErrorCode::usage,
                  fmt::format("vulkan: there is no device \"{}\"; there is {}", which, listing(devices)));
    }
    physical_ = std::move(devices[*chosen]);
    info_ = describe(physical_, int(*chosen));
    open_device();
  });
  keep_libraries();
  messages_->check();
}

bool Context::is_unified() const { return is_unified_type(properties_.deviceType); }

void Context::open_device() {
  const auto chain = physical_.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceFloatControlsProperties,
                                              vk::PhysicalDeviceExternalMemoryHostPropertiesEXT>();
  properties_ = chain.get<vk::PhysicalDeviceProperties2>().properties;
  memory_ = physical_.getMemoryProperties();
  heap_used.assign(memory_.memoryHeapCount, 0);
  const auto& floats = chain.get<vk::PhysicalDeviceFloatControlsProperties>();
  float_controls_.preserve_signed_zero_inf_nan = floats.shaderSignedZeroInfNanPreserveFloat32;
  float_controls_.round_to_nearest_even = floats.shaderRoundingModeRTEFloat32;

  std::vector<const char*> extensions;
  if (info_.shares_host_memory) {
    extensions.push_back(VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME);
    import_alignment_ =
        std::size_t(chain.get<vk::PhysicalDeviceExternalMemoryHostPropertiesEXT>().minImportedHostPointerAlignment);
  }
  queue_family_ = compute_family(physical_).value();
  const std::uint32_t bits = physical_.getQueueFamilyProperties()[queue_family_].timestampValidBits;
  timestamp_period_ = bits > 0 ? double(properties_.limits.timestampPeriod) : 0.0;
  timestamp_mask_ = bits >= 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << bits) - 1;

  const float priority = 1.0f;
  const vk::DeviceQueueCreateInfo queue({}, queue_family_, 1, &priority);
  vk::PhysicalDeviceVulkan12Features features;
  features.bufferDeviceAddress = true;
  const vk::StructureChain create(vk::DeviceCreateInfo({}, queue, {}, extensions), features);
  device_ = vk::raii::Device(physical_, create.get<vk::DeviceCreateInfo>());
  queue_ = device_.getQueue(queue_family_, 0);
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  try {
    const vk::raii::Context loader;
    const vk::raii::Instance instance = open_instance(loader, nullptr);
    for (const vk::raii::PhysicalDevice& device : fit_devices(instance))
      infos.push_back(describe(device, int(infos.size())));
    keep_libraries();
  } catch (const std::exception&) {
    // No loader, no driver, or one that fails: nothing can run here.
  }
  return infos;
}

}  // namespace smurf::vulkan
