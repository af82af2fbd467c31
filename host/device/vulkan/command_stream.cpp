// Records, submits and retires batches of commands.
#include "device/vulkan/command_stream.hpp"

#include <limits>

namespace smurf::vulkan {
namespace {

constexpr std::size_t commands_per_batch = 64;
constexpr std::size_t batches_in_flight = 4;

constexpr vk::PipelineStageFlags work =
    vk::PipelineStageFlagBits::eComputeShader | vk::PipelineStageFlagBits::eTransfer;
constexpr vk::AccessFlags writes = vk::AccessFlagBits::eShaderWrite | vk::AccessFlagBits::eTransferWrite;
constexpr vk::AccessFlags reads = vk::AccessFlagBits::eShaderRead | vk::AccessFlagBits::eTransferRead;

}  // namespace

CommandStream::CommandStream(std::shared_ptr<Context> context, bool timing)
    : context_(std::move(context)), timing_(timing && context_->timestamp_period() > 0) {
  const vk::CommandPoolCreateInfo create(
      vk::CommandPoolCreateFlagBits::eResetCommandBuffer | vk::CommandPoolCreateFlagBits::eTransient,
      context_->queue_family());
  pool_ = vk::raii::CommandPool(context_->device(), create);
}

CommandStream::~CommandStream() {
  try {
    finish();
  } catch (const std::exception&) {
    // The device is lost or the commands could not be submitted: nothing is left to wait for.
  }
}

CommandStream::Batch CommandStream::new_batch() const {
  const vk::raii::Device& device = context_->device();
  Batch batch;
  vk::raii::CommandBuffers buffers(device, vk::CommandBufferAllocateInfo(*pool_, vk::CommandBufferLevel::ePrimary, 1));
  batch.commands = std::move(buffers.front());
  batch.fence = vk::raii::Fence(device, vk::FenceCreateInfo());
  if (timing_) {
    batch.queries =
        vk::raii::QueryPool(device, vk::QueryPoolCreateInfo({}, vk::QueryType::eTimestamp, 2 * commands_per_batch));
  }
  return batch;
}

CommandStream::Batch& CommandStream::recording() {
  if (recording_) return *recording_;
  if (idle_.empty()) {
    recording_ = new_batch();
  } else {
    recording_ = std::move(idle_.back());
    idle_.pop_back();
  }
  recording_->number = next_batch_;
  recording_->commands.begin({vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
  if (timing_) recording_->commands.resetQueryPool(*recording_->queries, 0, 2 * commands_per_batch);
  return *recording_;
}

void CommandStream::before_command(Batch& batch) const {
  batch.commands.pipelineBarrier(work, work, {}, vk::MemoryBarrier(writes, writes | reads), {}, {});
}

void CommandStream::after_command(Batch& batch) {
  if (++batch.command_count == commands_per_batch) submit();
}

void CommandStream::dispatch(const Launch& launch) {
  Batch& batch = recording();
  before_command(batch);
  batch.commands.bindPipeline(vk::PipelineBindPoint::eCompute, launch.pipeline);
  batch.commands.pushConstants<std::byte>(
      launch.layout, vk::ShaderStageFlagBits::eCompute, 0,
      vk::ArrayProxy<const std::byte>(std::uint32_t(launch.constants.size()), launch.constants.data()));
  const std::uint32_t query = 2 * std::uint32_t(batch.timed.size());
  if (timing_) batch.commands.writeTimestamp(vk::PipelineStageFlagBits::eComputeShader, *batch.queries, query);
  batch.commands.dispatch(launch.groups_x, launch.groups_y, 1);
  if (timing_) {
    batch.commands.writeTimestamp(vk::PipelineStageFlagBits::eComputeShader, *batch.queries, query + 1);
    batch.timed.push_back(launch.kernel);
  }
  after_command(batch);
}

void CommandStream::copy(vk::Buffer from, std::size_t from_offset, vk::Buffer to, std::size_t to_offset,
                         std::size_t bytes) {
  Batch& batch = recording();
  before_command(batch);
  batch.commands.copyBuffer(from, to, vk::BufferCopy(from_offset, to_offset, bytes));
  after_command(batch);
}

void CommandStream::keep(std::shared_ptr<const void> object) { recording().kept.push_back(std::move(object)); }

void CommandStream::submit() {
  if (!recording_) return;
  Batch batch = std::move(*recording_);
  recording_.reset();
  next_batch_++;
  batch.commands.pipelineBarrier(work, vk::PipelineStageFlagBits::eHost, {},
                                 vk::MemoryBarrier(writes, vk::AccessFlagBits::eHostRead), {}, {});
  batch.commands.end();
  context_->queue().submit(vk::SubmitInfo({}, {}, *batch.commands), *batch.fence);
  in_flight_.push_back(std::move(batch));
  if (in_flight_.size() > batches_in_flight) retire_oldest();
}

void CommandStream::retire_oldest() {
  Batch& batch = in_flight_.front();
  const vk::Result result =
      context_->device().waitForFences(*batch.fence, true, std::numeric_limits<std::uint64_t>::max());
  if (result != vk::Result::eSuccess)
    throw Error(ErrorCode::device, fmt::format("vulkan: waiting for the device failed: {}", vk::to_string(result)));
  collect_times(batch);
  context_->device().resetFences(*batch.fence);
  batch.timed.clear();
  batch.kept.clear();
  batch.command_count = 0;
  batch.commands.reset();
  idle_.push_back(std::move(batch));
  in_flight_.pop_front();
}

void CommandStream::collect_times(const Batch& batch) {
  if (batch.timed.empty()) return;
  const std::uint32_t count = 2 * std::uint32_t(batch.timed.size());
  const auto [result, ticks] =
      batch.queries.getResults<std::uint64_t>(0, count, count * sizeof(std::uint64_t), sizeof(std::uint64_t),
                                              vk::QueryResultFlagBits::e64 | vk::QueryResultFlagBits::eWait);
  if (result != vk::Result::eSuccess) return;
  for (std::size_t i = 0; i < batch.timed.size(); i++) {
    KernelTime& time = times_[std::string(batch.timed[i])];
    const std::uint64_t elapsed = (ticks[2 * i + 1] - ticks[2 * i]) & context_->timestamp_mask();
    time.kernel = batch.timed[i];
    time.launches++;
    time.seconds += double(elapsed) * context_->timestamp_period() * 1e-9;
  }
}

void CommandStream::wait(std::uint64_t batch) {
  if (batch >= next_batch_) submit();
  while (!in_flight_.empty() && in_flight_.front().number <= batch) retire_oldest();
}

void CommandStream::finish() {
  submit();
  while (!in_flight_.empty()) retire_oldest();
}

std::vector<KernelTime> CommandStream::kernel_times() const {
  std::vector<KernelTime> times;
  for (const auto& [kernel, time] : times_) times.push_back(time);
  return times;
}

}  // namespace smurf::vulkan
