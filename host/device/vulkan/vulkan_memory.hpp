// Device buffers: allocation, import of host memory, transfers.
//
// Where the device's memory is the host's, buffers stay mapped and are copied to and from directly;
// elsewhere transfers go through staging buffers in chunks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string_view>

#include "device/vulkan/command_stream.hpp"

namespace smurf::vulkan {

// One buffer with memory of its own. Shared by the buffer's owner and the batches that use it.
struct Allocation {
  Allocation(std::shared_ptr<Context> owner, std::size_t size) : context(std::move(owner)), bytes(size) {}
  ~Allocation();
  Allocation(const Allocation&) = delete;
  Allocation& operator=(const Allocation&) = delete;

  std::shared_ptr<Context> context;
  std::size_t bytes;  // of the buffer as its owner sees it
  vk::raii::DeviceMemory memory = nullptr;
  vk::raii::Buffer buffer = nullptr;  // goes before its memory
  vk::DeviceAddress address = 0;
  std::byte* mapped = nullptr;  // null unless it can be written directly
  bool cached = false;          // reading through `mapped` is fast
  bool imported = false;        // stands on the caller's memory
  std::uint32_t heap = 0;
  std::size_t heap_bytes = 0;    // what it takes from its heap
  std::uint64_t last_batch = 0;  // of the commands that use it
};

enum class Transfers { automatic, staged };  // staged: as if no memory could be mapped, for tests

class Memory {
 public:
  Memory(std::shared_ptr<Context> context, std::shared_ptr<CommandStream> stream, Transfers transfers);

  // Throws Error (memory) when it does not fit.
  std::shared_ptr<Allocation> allocate(std::size_t bytes, std::string_view purpose);
  // Null where the device cannot take this memory.
  std::shared_ptr<Allocation> import(const void* host, std::size_t bytes);
  void write(Allocation& to, std::size_t offset, const void* data, std::size_t bytes);
  // Finishes the stream first.
  void read(const Allocation& from, std::size_t offset, void* data, std::size_t bytes);

 private:
  struct Staging {
    std::shared_ptr<Allocation> allocation;
    std::uint64_t last_batch = 0;
  };
  enum class Use { device, staging };
  std::shared_ptr<Allocation> make(std::size_t bytes, Use use, std::string_view purpose);
  std::uint32_t memory_type(std::uint32_t allowed, Use use) const;
  [[noreturn]] void refuse(std::size_t bytes, std::uint32_t heap, std::string_view purpose) const;
  std::size_t available(std::uint32_t heap) const;
  Staging& staging(std::size_t slot);

  std::shared_ptr<Context> context_;
  std::shared_ptr<CommandStream> stream_;
  Transfers transfers_;
  std::array<Staging, 2> staging_;
};

}  // namespace smurf::vulkan
