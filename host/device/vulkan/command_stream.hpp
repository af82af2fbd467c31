// Launches and copies in order on one queue, recorded in batches.
//
// A full memory barrier stands before each command. A batch is submitted when it is full or waited for;
// what its commands touch is kept alive until it has run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "device/vulkan/vulkan_context.hpp"

namespace smurf::vulkan {

struct Launch {
  std::string_view kernel;  // for its time
  vk::Pipeline pipeline;
  vk::PipelineLayout layout;
  std::span<const std::byte> constants;
  std::uint32_t groups_x = 1, groups_y = 1;
};

class CommandStream {
 public:
  CommandStream(std::shared_ptr<Context> context, bool timing);
  ~CommandStream();  // waits
  CommandStream(const CommandStream&) = delete;
  CommandStream& operator=(const CommandStream&) = delete;

  void dispatch(const Launch& launch);
  void copy(vk::Buffer from, std::size_t from_offset, vk::Buffer to, std::size_t to_offset, std::size_t bytes);
  // Keeps an object until what has been recorded so far is done.
  void keep(std::shared_ptr<const void> object);

  // The number of the batch that is being recorded; what it uses is marked with it. Numbers start at 1.
  std::uint64_t batch() const { return next_batch_; }
  // Waits for the batch with this number and all before it, submitting it if need be.
  void wait(std::uint64_t batch);
  void finish();

  std::vector<KernelTime> kernel_times() const;

 private:
  struct Batch {
    std::uint64_t number = 0;
    vk::raii::CommandBuffer commands = nullptr;
    vk::raii::Fence fence = nullptr;
    vk::raii::QueryPool queries = nullptr;
    std::size_t command_count = 0;
    std::vector<std::string_view> timed;  // kernels, two queries each
    std::vector<std::shared_ptr<const void>> kept;
  };
  Batch& recording();
  Batch new_batch() const;
  void before_command(Batch& batch) const;
  void after_command(Batch& batch);
  void submit();
  void retire_oldest();
  void collect_times(const Batch& batch);

  std::shared_ptr<Context> context_;
  bool timing_;
  vk::raii::CommandPool pool_ = nullptr;
  std::uint64_t next_batch_ = 1;
  std::optional<Batch> recording_;
  std::deque<Batch> in_flight_;
  std::vector<Batch> idle_;
  std::map<std::string, KernelTime, std::less<>> times_;
};

}  // namespace smurf::vulkan
