// The one seam between API and executors: buffers, programs and launches on one device.
//
// Launches and transfers happen in the order of the calls. Buffers are untyped for an executor;
// TypedBuffer keeps buffers of different meaning apart for its callers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "device/program.hpp"
#include "smurf/device.hpp"

namespace smurf {

class DeviceBuffer {
 public:
  virtual ~DeviceBuffer() = default;
  std::size_t bytes() const { return bytes_; }

 protected:
  explicit DeviceBuffer(std::size_t bytes) : bytes_(bytes) {}

 private:
  std::size_t bytes_;
};

class Executor {
 public:
  virtual ~Executor() = default;
  virtual const DeviceInfo& info() const = 0;

  // A buffer of at least `bytes` (at least one word), contents undefined. Throws Error (memory) that
  // names the purpose, how much was needed and how much there is.
  virtual std::unique_ptr<DeviceBuffer> allocate(std::size_t bytes, std::string_view purpose) = 0;
  // A read-only buffer with these contents: on the host's memory itself where the device allows, which
  // then must stay valid and unchanged; a copy otherwise. Padded to a whole word with undefined bytes.
  virtual std::unique_ptr<DeviceBuffer> share(const void* host, std::size_t bytes, std::string_view purpose) = 0;
  // The host's memory itself as a buffer that kernels write: what they wrote stands there once the buffer is gone. Null
  // where the device does not allow it; the caller then reads from a buffer of the device.
  virtual std::unique_ptr<DeviceBuffer> share_results(void* host, std::size_t bytes, std::string_view purpose) = 0;
  virtual void write(DeviceBuffer& buffer, std::size_t offset, const void* data, std::size_t bytes) = 0;
  // Waits for all launches before it.
  virtual void read(const DeviceBuffer& buffer, std::size_t offset, void* data, std::size_t bytes) = 0;

  // Compiles now rather than at the first launch.
  virtual void prepare(const Program& program) = 0;
  // Runs the kernel over `items` items (rays, points, blocks). Buffers and integers stand in the order of
  // bindings_of(); use the structs of arguments below rather than calling this directly. A null buffer is bound as a
  // valid dummy.
  virtual void launch(const Program& program, std::span<DeviceBuffer* const> buffers,
                      std::span<const std::int32_t> integers, std::size_t items) = 0;
  virtual void finish() = 0;

  virtual std::vector<KernelTime> kernel_times() const = 0;
  double compile_seconds = 0;
  std::size_t programs_compiled = 0;
  std::size_t programs_from_cache = 0;
};

// Opened by name of the device within the executor: a number, part of a name, or empty.
std::unique_ptr<Executor> open_opencl(std::string_view which, const DeviceOptions& options);
std::unique_ptr<Executor> open_vulkan(std::string_view which, const DeviceOptions& options);
std::vector<DeviceInfo> list_opencl();
std::vector<DeviceInfo> list_vulkan();

// Buffers of a group, by the names that kernels know them by.
struct NamedBuffer {
  std::string_view name;
  DeviceBuffer* buffer = nullptr;
};
using BufferGroup = std::vector<NamedBuffer>;

std::vector<std::string> names_of(const BufferGroup& group);

// One struct of named arguments per kernel, e.g. arguments::count_blocks{.counts = …}.
namespace arguments {
#define KERNEL(name, shape, group, bindings) \
  struct name {                              \
    bindings                                 \
  };
#define BUFFERS(name) BufferGroup name = {};
#define BUFFER(name) DeviceBuffer* name = nullptr;
#define INTEGER(name) std::int32_t name = 0;
#include "kernels/kernels.def"
#undef KERNEL
#undef BUFFERS
#undef BUFFER
#undef INTEGER
}  // namespace arguments

// Appends the buffers of a group. Throws std::logic_error when they are not those that the program names.
void append_group(const Program& program, std::string_view name, const BufferGroup& group,
                  std::vector<DeviceBuffer*>& buffers);

#define KERNEL(name, shape, group, bindings)                                                                    \
  inline void launch(Executor& executor, const Program& program, const arguments::name& a, std::size_t items) { \
    (void)a;                                                                                                    \
    std::vector<DeviceBuffer*> buffers;                                                                         \
    std::vector<std::int32_t> integers;                                                                         \
    bindings executor.launch(program, buffers, integers, items);                                                \
  }
#define BUFFERS(name) append_group(program, #name, a.name, buffers);
#define BUFFER(name) buffers.push_back(a.name);
#define INTEGER(name) integers.push_back(a.name);
#include "kernels/kernels.def"
#undef KERNEL
#undef BUFFERS
#undef BUFFER
#undef INTEGER

// A buffer whose elements have one meaning.
template <class T>
class TypedBuffer {
  static_assert(sizeof(T) % 4 == 0, "device buffers hold 32-bit words");

 public:
  TypedBuffer() = default;
  TypedBuffer(Executor& executor, std::size_t count, std::string_view purpose)
      : executor_(&executor), buffer_(executor.allocate(count * sizeof(T), purpose)) {}
  explicit operator bool() const { return buffer_ != nullptr; }
  DeviceBuffer* get() const { return buffer_.get(); }
  std::size_t bytes() const { return buffer_ ? buffer_->bytes() : 0; }
  void write(std::span<const T> values, std::size_t first = 0) {
    executor_->write(*buffer_, first * sizeof(T), values.data(), values.size_bytes());
  }
  void read(std::span<T> values, std::size_t first = 0) const {
    executor_->read(*buffer_, first * sizeof(T), values.data(), values.size_bytes());
  }

 private:
  Executor* executor_ = nullptr;
  std::unique_ptr<DeviceBuffer> buffer_;
};

}  // namespace smurf
