// Buffers, programs and launches on one OpenCL device, over one in-order queue.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "device/executor.hpp"
#include "device/opencl/opencl_support.hpp"

namespace smurf::opencl {

class OpenclExecutor final : public Executor {
 public:
  OpenclExecutor(FoundDevice found, const DeviceOptions& options);
  ~OpenclExecutor() override;
  OpenclExecutor(const OpenclExecutor&) = delete;
  OpenclExecutor& operator=(const OpenclExecutor&) = delete;

  const DeviceInfo& info() const override { return found_.info; }
  std::unique_ptr<DeviceBuffer> allocate(std::size_t bytes, std::string_view purpose) override;
  std::unique_ptr<DeviceBuffer> share(const void* host, std::size_t bytes, std::string_view purpose) override;
  std::unique_ptr<DeviceBuffer> share_results(void* host, std::size_t bytes, std::string_view purpose) override;
  void write(DeviceBuffer& buffer, std::size_t offset, const void* data, std::size_t bytes) override;
  void read(const DeviceBuffer& buffer, std::size_t offset, void* data, std::size_t bytes) override;
  void prepare(const Program& program) override;
  void launch(const Program& program, std::span<DeviceBuffer* const> buffers, std::span<const std::int32_t> integers,
              std::size_t items) override;
  void finish() override;
  std::vector<KernelTime> kernel_times() const override;

 private:
  void require_memory(std::size_t bytes, bool counted, std::string_view purpose) const;
  bool writes_host_memory() const;
  std::size_t work_group(const KernelSpec& spec) const;
  cl::Kernel& kernel_of(const Program& program);
  cl::Program build(const Program& program, const std::string& source);
  cl::Program load(const std::string& key) const;
  void store(const std::string& key, const cl::Program& program) const;
  [[noreturn]] void throw_build_failure(const Program& program, const cl::Program& built, const cl::Error& error) const;
  void collect_times() const;

  FoundDevice found_;
  cl::Context context_;
  cl::CommandQueue queue_;
  std::size_t largest_group_ = 1;
  std::string build_options_;
  std::string compiler_;  // identifies what turns source into a binary
  bool timing_ = false;
  bool is_pocl_ = false;
  cl::Buffer dummy_;
  std::shared_ptr<std::atomic<std::size_t>> bytes_in_use_;  // shared with the buffers, which may live longer
  std::map<Program, cl::Kernel> kernels_;
  mutable std::vector<std::pair<KernelId, cl::Event>> pending_;  // launched, time not yet collected
  mutable std::map<KernelId, KernelTime> times_;
};

}  // namespace smurf::opencl
