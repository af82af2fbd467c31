// The Vulkan executor: programs to pipelines, launches to dispatches.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "device/executor.hpp"
#include "device/vulkan/vulkan_memory.hpp"

namespace smurf::vulkan {

class VulkanExecutor final : public Executor {
 public:
  VulkanExecutor(std::string_view which, const DeviceOptions& options, Transfers transfers = Transfers::automatic);
  ~VulkanExecutor() override;
  VulkanExecutor(const VulkanExecutor&) = delete;
  VulkanExecutor& operator=(const VulkanExecutor&) = delete;

  const DeviceInfo& info() const override { return info_; }
  std::unique_ptr<DeviceBuffer> allocate(std::size_t bytes, std::string_view purpose) override;
  std::unique_ptr<DeviceBuffer> share(const void* host, std::size_t bytes, std::string_view purpose) override;
  // Imported memory is only read: writing to it would need what the driver caches to be flushed page by page.
  std::unique_ptr<DeviceBuffer> share_results(void*, std::size_t, std::string_view) override { return nullptr; }
  void write(DeviceBuffer& buffer, std::size_t offset, const void* data, std::size_t bytes) override;
  void read(const DeviceBuffer& buffer, std::size_t offset, void* data, std::size_t bytes) override;
  void prepare(const Program& program) override;
  void launch(const Program& program, std::span<DeviceBuffer* const> buffers, std::span<const std::int32_t> integers,
              std::size_t items) override;
  void finish() override;
  std::vector<KernelTime> kernel_times() const override;

 private:
  const vk::raii::Pipeline& pipeline(const Program& program);
  std::vector<std::uint32_t> spirv(const Program& program);

  std::shared_ptr<Context> context_;
  DeviceInfo info_;
  vk::raii::PipelineLayout layout_ = nullptr;
  std::map<Program, vk::raii::Pipeline> pipelines_;
  std::shared_ptr<CommandStream> stream_;
  std::unique_ptr<Memory> memory_;
  std::shared_ptr<Allocation> nothing_;  // stands in for buffers that are null
};

}  // namespace smurf::vulkan
