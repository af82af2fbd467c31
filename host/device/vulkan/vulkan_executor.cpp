// Kernels get their arguments as push constants: the 64-bit addresses of the buffers, then the integers. Where these
// are more than push constants hold, the address of a table of the buffers' addresses stands in their place. There are
// no descriptor sets.
#include "device/vulkan/vulkan_executor.hpp"

#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>

namespace smurf::vulkan {
namespace {

class VulkanBuffer final : public DeviceBuffer {
 public:
  VulkanBuffer(std::shared_ptr<Allocation> memory, std::shared_ptr<CommandStream> commands)
      : DeviceBuffer(memory->bytes), allocation(std::move(memory)), stream(std::move(commands)) {}
  ~VulkanBuffer() override {
    // Batches keep the allocation alive, but not the caller's memory on which it may stand.
    if (!allocation->imported) return;
    try {
      stream->wait(allocation->last_batch);
    } catch (const std::exception&) {
      // The device is lost: it no longer reads.
    }
  }

  std::shared_ptr<Allocation> allocation;
  std::shared_ptr<CommandStream> stream;
};

Allocation& allocation_of(const DeviceBuffer& buffer) { return *static_cast<const VulkanBuffer&>(buffer).allocation; }

void check_range(const DeviceBuffer& buffer, std::size_t offset, std::size_t bytes, std::string_view verb) {
  if (offset <= buffer.bytes() && bytes <= buffer.bytes() - offset) return;
  throw Error(ErrorCode::usage, fmt::format("vulkan: cannot {} {} bytes at {} of a buffer of {} bytes", verb, bytes,
                                            offset, buffer.bytes()));
}

DeviceOptions with_environment(DeviceOptions options) {
  const auto is_on = [](const char* name) {
    const char* value = std::getenv(name);
    return value && *value && std::string_view(value) != "0";
  };
  options.validation = options.validation || is_on("SMURF_VALIDATION");
  options.timing = options.timing || is_on("SMURF_TIMING");
  return options;
}

}  // namespace

VulkanExecutor::VulkanExecutor(std::string_view which, const DeviceOptions& given, Transfers transfers) {
  const DeviceOptions options = with_environment(given);
  context_ = std::make_shared<Context>(which, options);
  info_ = context_->info();
  info_.shares_host_memory = info_.shares_host_memory && transfers == Transfers::automatic;
  guarded("preparing the device", [&] {
    const vk::PushConstantRange range(vk::ShaderStageFlagBits::eCompute, 0, push_constant_bytes);
    layout_ = vk::raii::PipelineLayout(context_->device(), vk::PipelineLayoutCreateInfo({}, {}, range));
    stream_ = std::make_shared<CommandStream>(context_, options.timing);
    memory_ = std::make_unique<Memory>(context_, stream_, transfers);
    nothing_ = memory_->allocate(4, "what stands for null buffers");
  });
  context_->check_messages();
}

VulkanExecutor::~VulkanExecutor() {
  // Buffers may outlive the executor and keep the stream; the pipelines of pending launches go now.
  try {
    stream_->finish();
  } catch (const std::exception&) {
    // The device is lost: it no longer runs anything.
  }
}

std::unique_ptr<DeviceBuffer> VulkanExecutor::allocate(std::size_t bytes, std::string_view purpose) {
  context_->check_messages();
  return guarded("allocating memory",
                 [&] { return std::make_unique<VulkanBuffer>(memory_->allocate(bytes, purpose), stream_); });
}

std::unique_ptr<DeviceBuffer> VulkanExecutor::share(const void* host, std::size_t bytes, std::string_view purpose) {
  context_->check_messages();
  return guarded("sharing memory", [&] {
    std::shared_ptr<Allocation> allocation = memory_->import(host, bytes);
    if (!allocation) {
      allocation = memory_->allocate(bytes, purpose);
      if (bytes > 0) memory_->write(*allocation, 0, host, bytes);
    }
    return std::make_unique<VulkanBuffer>(std::move(allocation), stream_);
  });
}

void VulkanExecutor::write(DeviceBuffer& buffer, std::size_t offset, const void* data, std::size_t bytes) {
  context_->check_messages();
  check_range(buffer, offset, bytes, "write");
  if (allocation_of(buffer).imported) throw Error(ErrorCode::usage, "vulkan: a shared buffer is read-only");
  if (bytes > 0) guarded("writing a buffer", [&] { memory_->write(allocation_of(buffer), offset, data, bytes); });
}

void VulkanExecutor::read(const DeviceBuffer& buffer, std::size_t offset, void* data, std::size_t bytes) {
  context_->check_messages();
  check_range(buffer, offset, bytes, "read");
  guarded("reading a buffer", [&] {
    if (bytes > 0) memory_->read(allocation_of(buffer), offset, data, bytes);
  });
  context_->check_messages();
}

std::vector<std::uint32_t> VulkanExecutor::spirv(const Program& program) {
  const KernelSpec& spec = spec_of(program.kernel);
  const std::string source = assemble(program, Language::glsl, 1, spec.group);
  const std::string key = content_key(source, compiler_identity(context_->float_controls()));
  dump_program(program, source, key, "comp");
  std::vector<std::uint32_t> module;
  if (const auto cached = load_cached(key); cached && !cached->empty() && cached->size() % sizeof(std::uint32_t) == 0) {
    module.resize(cached->size() / sizeof(std::uint32_t));
    std::memcpy(module.data(), cached->data(), cached->size());
    programs_from_cache++;
    return module;
  }
  module = compile_glsl(source, spec.name, context_->float_controls());
  store_cached(key, module.data(), module.size() * sizeof(std::uint32_t));
  programs_compiled++;
  return module;
}

const vk::raii::Pipeline& VulkanExecutor::pipeline(const Program& program) {
  if (const auto known = pipelines_.find(program); known != pipelines_.end()) return known->second;
  const auto start = std::chrono::steady_clock::now();
  const std::vector<std::uint32_t> module = spirv(program);
  const vk::raii::Device& device = context_->device();
  const auto& made =
      guarded(fmt::format("making the pipeline of kernel {}", spec_of(program.kernel).name),
              [&]() -> const vk::raii::Pipeline& {
                const vk::raii::ShaderModule shader(device, vk::ShaderModuleCreateInfo({}, module));
                const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *shader, "main");
                vk::raii::Pipeline created(device, nullptr, vk::ComputePipelineCreateInfo({}, stage, *layout_));
                return pipelines_.emplace(program, std::move(created)).first->second;
              });
  compile_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return made;
}

void VulkanExecutor::prepare(const Program& program) {
  context_->check_messages();
  pipeline(program);
  context_->check_messages();
}

void VulkanExecutor::launch(const Program& program, std::span<DeviceBuffer* const> buffers,
                            std::span<const std::int32_t> integers, std::size_t items) {
  context_->check_messages();
  const KernelSpec& spec = spec_of(program.kernel);
  const Bindings bindings = bindings_of(program);
  if (buffers.size() != bindings.buffers.size() || integers.size() != bindings.integers.size()) {
    throw Error(ErrorCode::usage,
                fmt::format("vulkan: kernel {} takes {} buffers and {} integers, not {} and {}", spec.name,
                            bindings.buffers.size(), bindings.integers.size(), buffers.size(), integers.size()));
  }
  if (items == 0) return;
  // Work groups lie in rows, since one row is limited; kernels pass over items beyond their count.
  const std::size_t groups = (items + std::size_t(spec.group) - 1) / std::size_t(spec.group);
  const auto& limits = context_->properties().limits.maxComputeWorkGroupCount;
  const std::size_t rows = (groups + limits[0] - 1) / limits[0];
  const std::size_t row_length = (groups + rows - 1) / rows;
  const std::size_t all_items = rows * row_length * std::size_t(spec.group);
  if (rows > limits[1] || all_items > std::size_t(std::numeric_limits<std::int32_t>::max())) {
    throw Error(ErrorCode::usage, fmt::format("vulkan: kernel {} cannot run on {} items at once", spec.name, items));
  }

  std::array<std::byte, push_constant_bytes> constants;
  std::size_t used = 0;
  const auto push = [&](auto value) {
    std::memcpy(constants.data() + used, &value, sizeof value);
    used += sizeof value;
  };
  const vk::raii::Pipeline& to_run = pipeline(program);
  guarded(fmt::format("launching kernel {}", spec.name), [&] {
    std::vector<std::shared_ptr<Allocation>> used_by_launch;
    for (const DeviceBuffer* buffer : buffers)
      used_by_launch.push_back(buffer ? static_cast<const VulkanBuffer*>(buffer)->allocation : nothing_);
    std::vector<vk::DeviceAddress> addresses;
    for (const auto& allocation : used_by_launch) addresses.push_back(allocation->address);
    if (takes_table(buffers.size(), integers.size())) {
      const std::size_t bytes = addresses.size() * sizeof addresses[0];
      used_by_launch.push_back(memory_->allocate(bytes, "addresses of a kernel's buffers"));
      memory_->write(*used_by_launch.back(), 0, addresses.data(), bytes);
      addresses = {used_by_launch.back()->address};
    }
    for (const vk::DeviceAddress address : addresses) push(address);
    for (const auto& allocation : used_by_launch) {
      allocation->last_batch = stream_->batch();
      stream_->keep(allocation);
    }
    for (const std::int32_t integer : integers) push(integer);
    stream_->dispatch(
        {spec.name, *to_run, *layout_, {constants.data(), used}, std::uint32_t(row_length), std::uint32_t(rows)});
  });
}

void VulkanExecutor::finish() {
  context_->check_messages();
  guarded("waiting for the device", [&] { stream_->finish(); });
  context_->check_messages();
}

std::vector<KernelTime> VulkanExecutor::kernel_times() const {
  guarded("waiting for the device", [&] { stream_->finish(); });
  return stream_->kernel_times();
}

}  // namespace smurf::vulkan

namespace smurf {

std::unique_ptr<Executor> open_vulkan(std::string_view which, const DeviceOptions& options) {
  return std::make_unique<vulkan::VulkanExecutor>(which, options);
}

std::vector<DeviceInfo> list_vulkan() { return vulkan::list_devices(); }

}  // namespace smurf
