// Allocation, import and transfers of Vulkan buffers.
//
// Every buffer has one allocation of its own: there are few, and large ones. A mapped buffer is written
// at once unless commands that use it are still under way; host writes before a submission are visible
// to its commands, and each batch ends with a barrier towards the host.
#include "device/vulkan/vulkan_memory.hpp"

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <limits>

namespace smurf::vulkan {
namespace {

using Flag = vk::MemoryPropertyFlagBits;
constexpr std::size_t staging_bytes = std::size_t(16) << 20;
constexpr vk::ExternalMemoryHandleTypeFlagBits host_memory = vk::ExternalMemoryHandleTypeFlagBits::eHostAllocationEXT;
constexpr vk::BufferUsageFlags usage = vk::BufferUsageFlagBits::eStorageBuffer | vk::BufferUsageFlagBits::eTransferSrc |
                                       vk::BufferUsageFlagBits::eTransferDst |
                                       vk::BufferUsageFlagBits::eShaderDeviceAddress;

double in_mebibytes(std::size_t bytes) { return double(bytes) / (1024.0 * 1024.0); }

// The first allowed type that has all of one of the flag sets, tried in order.
std::uint32_t find_type(const vk::PhysicalDeviceMemoryProperties& memory, std::uint32_t allowed,
                        std::initializer_list<vk::MemoryPropertyFlags> preferred) {
  for (const vk::MemoryPropertyFlags wanted : preferred) {
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; i++) {
      if ((allowed >> i & 1) && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
    }
  }
  throw Error(ErrorCode::device, "vulkan: the device has no memory type for buffers");
}

// Memory whose address shaders may use; `next` is what to chain behind it, or null.
vk::MemoryAllocateFlagsInfo addressable(const void* next = nullptr) {
  vk::MemoryAllocateFlagsInfo flags(vk::MemoryAllocateFlagBits::eDeviceAddress);
  flags.pNext = next;
  return flags;
}

}  // namespace

Allocation::~Allocation() {
  if (heap_bytes > 0) context->heap_used[heap] -= heap_bytes;
}

Memory::Memory(std::shared_ptr<Context> context, std::shared_ptr<CommandStream> stream, Transfers transfers)
    : context_(std::move(context)), stream_(std::move(stream)), transfers_(transfers) {}

std::uint32_t Memory::memory_type(std::uint32_t allowed, Use use) const {
  const vk::MemoryPropertyFlags visible = Flag::eHostVisible | Flag::eHostCoherent;
  if (use == Use::staging) return find_type(context_->memory(), allowed, {visible | Flag::eHostCached, visible});
  if (context_->is_unified()) {
    return find_type(
        context_->memory(), allowed,
        {Flag::eDeviceLocal | visible | Flag::eHostCached, Flag::eDeviceLocal | visible, Flag::eDeviceLocal, {}});
  }
  // Plain device memory comes first in the list of types, before what can also be mapped.
  return find_type(context_->memory(), allowed, {Flag::eDeviceLocal, {}});
}

std::size_t Memory::available(std::uint32_t heap) const {
  const std::size_t size = context_->memory().memoryHeaps[heap].size;
  const std::size_t used = context_->heap_used[heap];
  return std::min(size - std::min(size, used), context_->info().largest_allocation);
}

void Memory::refuse(std::size_t bytes, std::uint32_t heap, std::string_view purpose) const {
  throw Error(ErrorCode::memory,
              fmt::format("vulkan: {} does not fit {}: needs {:.1f} MiB, available {:.1f} MiB (of {:.1f} MiB; one "
                          "buffer at most {:.1f} MiB)",
                          purpose, context_->info().name, in_mebibytes(bytes), in_mebibytes(available(heap)),
                          in_mebibytes(context_->memory().memoryHeaps[heap].size),
                          in_mebibytes(context_->info().largest_allocation)));
}

std::shared_ptr<Allocation> Memory::make(std::size_t bytes, Use use, std::string_view purpose) {
  const vk::raii::Device& device = context_->device();
  const std::size_t padded = std::max<std::size_t>((bytes + 3) / 4 * 4, 4);
  // Drivers may not accept the creation of a buffer that is larger than any memory.
  if (bytes > context_->info().largest_allocation) {
    refuse(bytes, context_->memory().memoryTypes[memory_type(~0u, use)].heapIndex, purpose);
  }
  auto made = std::make_shared<Allocation>(context_, padded);
  made->buffer = vk::raii::Buffer(device, vk::BufferCreateInfo({}, padded, usage));
  const vk::MemoryRequirements needs = made->buffer.getMemoryRequirements();
  const std::uint32_t type = memory_type(needs.memoryTypeBits, use);
  const std::uint32_t heap = context_->memory().memoryTypes[type].heapIndex;
  if (needs.size > available(heap)) refuse(needs.size, heap, purpose);
  const vk::MemoryAllocateFlagsInfo flags = addressable();
  try {
    made->memory = vk::raii::DeviceMemory(device, vk::MemoryAllocateInfo(needs.size, type, &flags));
  } catch (const vk::OutOfDeviceMemoryError&) {
    refuse(needs.size, heap, purpose);
  } catch (const vk::OutOfHostMemoryError&) {
    refuse(needs.size, heap, purpose);
  }
  made->heap = heap;
  made->heap_bytes = needs.size;
  context_->heap_used[heap] += needs.size;
  made->buffer.bindMemory(*made->memory, 0);
  made->address = device.getBufferAddress({*made->buffer});

  const vk::MemoryPropertyFlags properties = context_->memory().memoryTypes[type].propertyFlags;
  const vk::MemoryPropertyFlags direct = Flag::eHostVisible | Flag::eHostCoherent;
  const bool map = use == Use::staging || (transfers_ == Transfers::automatic && context_->is_unified());
  if (map && (properties & direct) == direct) {
    made->mapped = static_cast<std::byte*>(made->memory.mapMemory(0, VK_WHOLE_SIZE));
    made->cached = bool(properties & Flag::eHostCached);
  }
  return made;
}

std::shared_ptr<Allocation> Memory::allocate(std::size_t bytes, std::string_view purpose) {
  return make(bytes, Use::device, purpose);
}

std::shared_ptr<Allocation> Memory::import(const void* host, std::size_t bytes) {
  const std::size_t alignment = context_->import_alignment();
  if (transfers_ == Transfers::staged || alignment == 0 || bytes == 0) return nullptr;
  // What can be imported are whole pages; the buffer spans those that the caller's memory touches, and
  // its address points to the caller's first byte. Shaders load whole words.
  const auto first = reinterpret_cast<std::uintptr_t>(host);
  const std::uintptr_t start = first / alignment * alignment;
  const std::size_t span = (first + bytes - start + alignment - 1) / alignment * alignment;
  if (first % 4 != 0 || span > context_->info().largest_allocation) return nullptr;
  try {
    const vk::raii::Device& device = context_->device();
    void* const pages = reinterpret_cast<void*>(start);
    auto made = std::make_shared<Allocation>(context_, (bytes + 3) / 4 * 4);
    const vk::ExternalMemoryBufferCreateInfo external(host_memory);
    vk::BufferCreateInfo create({}, span, usage);
    create.pNext = &external;
    made->buffer = vk::raii::Buffer(device, create);
    const vk::MemoryRequirements needs = made->buffer.getMemoryRequirements();
    const auto host_properties = device.getMemoryHostPointerPropertiesEXT(host_memory, pages);
    const std::uint32_t allowed = needs.memoryTypeBits & host_properties.memoryTypeBits;
    if (needs.size > span || allowed == 0) return nullptr;
    const vk::ImportMemoryHostPointerInfoEXT import_info(host_memory, pages);
    const vk::MemoryAllocateFlagsInfo flags = addressable(&import_info);
    made->memory =
        vk::raii::DeviceMemory(device, vk::MemoryAllocateInfo(span, memory_type(allowed, Use::device), &flags));
    made->buffer.bindMemory(*made->memory, 0);
    made->address = device.getBufferAddress({*made->buffer}) + (first - start);
    made->imported = true;
    made->mapped = reinterpret_cast<std::byte*>(first);
    made->cached = true;
    return made;
  } catch (const vk::Error&) {
    return nullptr;  // memory of a kind that the driver cannot pin, such as a mapped file: copy it
  }
}

Memory::Staging& Memory::staging(std::size_t slot) {
  Staging& staging = staging_[slot];
  if (!staging.allocation) staging.allocation = make(staging_bytes, Use::staging, "staging memory");
  stream_->wait(staging.last_batch);
  staging.last_batch = 0;
  return staging;
}

void Memory::write(Allocation& to, std::size_t offset, const void* data, std::size_t bytes) {
  const std::byte* from = static_cast<const std::byte*>(data);
  if (to.mapped) {
    stream_->wait(to.last_batch);
    std::memcpy(to.mapped + offset, from, bytes);
    return;
  }
  for (std::size_t done = 0, slot = 0; done < bytes; slot = 1 - slot) {
    Staging& through = staging(slot);
    const std::size_t chunk = std::min(staging_bytes, bytes - done);
    std::memcpy(through.allocation->mapped, from + done, chunk);
    through.last_batch = to.last_batch = stream_->batch();
    stream_->copy(*through.allocation->buffer, 0, *to.buffer, offset + done, chunk);
    done += chunk;
  }
}

void Memory::read(const Allocation& from, std::size_t offset, void* data, std::size_t bytes) {
  std::byte* to = static_cast<std::byte*>(data);
  if (from.mapped && from.cached) {
    stream_->finish();
    std::memcpy(to, from.mapped + offset, bytes);
    return;
  }
  for (std::size_t done = 0; done < bytes;) {
    Staging& through = staging(0);
    const std::size_t chunk = std::min(staging_bytes, bytes - done);
    stream_->copy(*from.buffer, offset + done, *through.allocation->buffer, 0, chunk);
    stream_->finish();
    std::memcpy(to + done, through.allocation->mapped, chunk);
    done += chunk;
  }
}

}  // namespace smurf::vulkan
