// The Vulkan executor by itself: choice of device, memory, transfers, sharing, launches. Validation layers are on in
// every test; any message of theirs is an Error from the next call.
#include "device/vulkan/vulkan_executor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <memory>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/layout/records.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using vulkan::Transfers;
using vulkan::VulkanExecutor;

DeviceOptions validated() {
  DeviceOptions options;
  options.validation = true;
  return options;
}

std::vector<std::uint32_t> numbers(std::size_t count, std::uint32_t first = 1) {
  std::vector<std::uint32_t> values(count);
  std::iota(values.begin(), values.end(), first);
  return values;
}

// Error code and message of what f throws; the test fails when it throws nothing.
template <class F>
std::pair<ErrorCode, std::string> error_of(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

// Both ways of transfer: mapped memory, and staging as on discrete GPUs.
class VulkanTransfers : public testing::TestWithParam<Transfers> {
 protected:
  VulkanExecutor executor{"", validated(), GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Ways, VulkanTransfers, testing::Values(Transfers::automatic, Transfers::staged),
                         [](const auto& info) { return info.param == Transfers::staged ? "staged" : "automatic"; });

TEST_P(VulkanTransfers, WritesAndReadsAtOffsets) {
  const auto buffer = executor.allocate(4000, "a buffer");
  const auto all = numbers(1000);
  executor.write(*buffer, 0, all.data(), 4000);
  const auto some = numbers(10, 5000);
  executor.write(*buffer, 400, some.data(), 40);
  std::vector<std::uint32_t> back(1000);
  executor.read(*buffer, 0, back.data(), 4000);
  for (std::size_t i = 0; i < back.size(); i++) EXPECT_EQ(back[i], i >= 100 && i < 110 ? 5000 + i - 100 : i + 1) << i;
  std::uint32_t word = 0;
  executor.read(*buffer, 4 * 999, &word, 4);
  EXPECT_EQ(word, 1000u);
  executor.finish();
}

TEST_P(VulkanTransfers, CrossesStagingChunks) {
  const std::size_t count = (std::size_t(40) << 20) / 4 + 3;
  const auto buffer = executor.allocate(4 * count + 8, "a large buffer");
  const auto all = numbers(count);
  executor.write(*buffer, 8, all.data(), 4 * count);
  std::vector<std::uint32_t> back(count);
  executor.read(*buffer, 8, back.data(), 4 * count);
  EXPECT_TRUE(back == all);
  executor.finish();
}

TEST_P(VulkanTransfers, SharesOddSizesAndPlaces) {
  std::vector<std::byte> bytes(20000);
  for (std::size_t i = 0; i < bytes.size(); i++) bytes[i] = std::byte(i * 7 + i / 256);
  for (const std::size_t offset : {0, 1, 4, 6, 1000, 4096}) {
    for (const std::size_t size : {0, 1, 2, 3, 5, 4095, 4097, 12345}) {
      const auto shared = executor.share(bytes.data() + offset, size, "a shared buffer");
      ASSERT_GE(shared->bytes(), size);
      ASSERT_EQ(shared->bytes() % 4, 0u);
      std::vector<std::byte> back(size);
      executor.read(*shared, 0, back.data(), size);
      EXPECT_TRUE(std::equal(back.begin(), back.end(), bytes.begin() + std::ptrdiff_t(offset)))
          << size << " bytes at " << offset;
    }
  }
  executor.finish();
}

// Per block the sum of its counts, the greatest of them, and the first that is negative (or -1).
constexpr std::size_t block_words = BLOCK_WORDS;  // what count_blocks writes for each block of rays

void count_blocks(VulkanExecutor& executor, DeviceBuffer* counts, DeviceBuffer* blocks, int count, int block) {
  launch(executor, Program{KernelId::count_blocks, {}, {}},
         arguments::count_blocks{.counts = counts, .blocks = blocks, .count = count, .block = block},
         std::size_t((count + block - 1) / block));
}

TEST_P(VulkanTransfers, RunsKernelsOnSharedAndOwnBuffersInOrder) {
  constexpr int count = 1000, block = 100;
  std::vector<std::int32_t> counts(count, 2);
  counts[250] = -1;                               // a ray that is not valid
  counts[420] = -2;                               // one that was cut
  for (int repeat = 0; repeat < 200; repeat++) {  // more than a batch
    const auto source = executor.share(counts.data(), 4 * counts.size(), "counts");
    const auto blocks = executor.allocate(block_words * 4 * (count / block), "blocks");
    count_blocks(executor, source.get(), blocks.get(), count, block);
    if (repeat % 70 != 0) continue;  // the others go while their launch is pending
    std::vector<std::int32_t> result(block_words * (count / block));
    executor.read(*blocks, 0, result.data(), 4 * result.size());
    for (int i = 0; i < count / block; i++) {
      EXPECT_EQ(result[block_words * std::size_t(i)], i == 2 || i == 4 ? 198 : 200) << "block " << i;
      EXPECT_EQ(result[block_words * std::size_t(i) + 1], 2) << "block " << i;
      EXPECT_EQ(result[block_words * std::size_t(i) + 2], i == 2 ? 250 : -1) << "block " << i;
      EXPECT_EQ(result[block_words * std::size_t(i) + 3], i == 4 ? 420 : -1) << "block " << i;
    }
  }
  executor.finish();
  EXPECT_EQ(executor.programs_compiled + executor.programs_from_cache, 1u);
  EXPECT_GT(executor.compile_seconds, 0.0);
}

TEST_P(VulkanTransfers, WritesWaitForLaunchesBeforeThem) {
  constexpr int count = 100000, block = 100;
  const auto counts = executor.allocate(4 * count, "counts");
  const auto first = executor.allocate(4 * block_words * (count / block), "blocks");
  const auto second = executor.allocate(4 * block_words * (count / block), "blocks");
  const std::vector<std::uint32_t> ones(count, 1), threes(count, 3);
  executor.write(*counts, 0, ones.data(), 4 * ones.size());
  count_blocks(executor, counts.get(), first.get(), count, block);
  executor.write(*counts, 0, threes.data(), 4 * threes.size());
  count_blocks(executor, counts.get(), second.get(), count, block);
  std::vector<std::uint32_t> result(block_words * (count / block));
  executor.read(*first, 0, result.data(), 4 * result.size());
  for (std::size_t i = 0; i < result.size(); i += block_words)
    ASSERT_EQ(result[i], 100u) << "block " << i / block_words;
  executor.read(*second, 0, result.data(), 4 * result.size());
  for (std::size_t i = 0; i < result.size(); i += block_words)
    ASSERT_EQ(result[i], 300u) << "block " << i / block_words;
  executor.finish();
}

// 65535 work groups of 64 items make a row on many devices; this takes two.
TEST_P(VulkanTransfers, RunsMoreItemsThanOneRowOfWorkGroups) {
  constexpr int count = 65535 * 64 + 1000;
  const auto counts = executor.allocate(4 * std::size_t(count), "counts");
  const auto blocks = executor.allocate(4 * block_words * std::size_t(count), "blocks");
  const auto values = numbers(count);
  executor.write(*counts, 0, values.data(), 4 * values.size());
  count_blocks(executor, counts.get(), blocks.get(), count, 1);
  std::vector<std::uint32_t> result(block_words * std::size_t(count));
  executor.read(*blocks, 0, result.data(), 4 * result.size());
  for (std::size_t i = 0; i < values.size(); i++) ASSERT_EQ(result[block_words * i], values[i]) << i;
  executor.finish();
}

TEST_P(VulkanTransfers, TakesNullBuffers) {
  const auto blocks = executor.allocate(4 * block_words, "blocks");
  count_blocks(executor, nullptr, blocks.get(), 1, 1);  // reads one word of what stands for it
  executor.finish();
}

TEST_P(VulkanTransfers, RefusesWhatDoesNotFit) {
  const std::size_t much = executor.info().memory + (std::size_t(1) << 30);
  const auto [code, message] = error_of([&] { executor.allocate(much, "the coefficients"); });
  EXPECT_EQ(code, ErrorCode::memory);
  EXPECT_NE(message.find("the coefficients"), std::string::npos) << message;
  EXPECT_NE(message.find(fmt::format("needs {:.1f} MiB", double(much) / (1 << 20))), std::string::npos) << message;
  EXPECT_NE(message.find("available "), std::string::npos) << message;
  // Pieces that fit one by one but not together, and again once one of them is gone.
  const std::size_t piece = executor.info().memory / 3;
  auto a = executor.allocate(piece, "a");
  auto b = executor.allocate(piece, "b");
  EXPECT_EQ(error_of([&] { executor.allocate(piece + (std::size_t(64) << 20), "c"); }).first, ErrorCode::memory);
  a.reset();
  EXPECT_NO_THROW(executor.allocate(piece, "d"));
  executor.finish();
}

TEST_P(VulkanTransfers, RefusesTransfersBeyondTheBuffer) {
  const auto buffer = executor.allocate(16, "a buffer");
  std::uint32_t words[8] = {};
  EXPECT_EQ(error_of([&] { executor.write(*buffer, 4, words, 16); }).first, ErrorCode::usage);
  EXPECT_EQ(error_of([&] { executor.read(*buffer, 20, words, 4); }).first, ErrorCode::usage);
}

TEST(Vulkan, ListsDevices) {
  const auto devices = list_vulkan();
  ASSERT_FALSE(devices.empty()) << "no Vulkan device here: install mesa-vulkan-drivers";
  for (std::size_t i = 0; i < devices.size(); i++) {
    EXPECT_EQ(devices[i].executor, "vulkan");
    EXPECT_EQ(devices[i].index, int(i));
    EXPECT_GT(devices[i].memory, 0u);
    EXPECT_GT(devices[i].largest_allocation, 0u);
  }
}

TEST(Vulkan, OpensByNumberAndName) {
  const auto devices = list_vulkan();
  ASSERT_FALSE(devices.empty());
  EXPECT_EQ(open_vulkan("0", validated())->info().name, devices[0].name);
  EXPECT_EQ(open_vulkan(devices[0].name.substr(0, 5), validated())->info().name, devices[0].name);
}

TEST(Vulkan, UnknownDeviceNamesWhatThereIs) {
  const auto devices = list_vulkan();
  ASSERT_FALSE(devices.empty());
  for (const char* which : {"99", "no such device"}) {
    const auto [code, message] = error_of([&] { open_vulkan(which, validated()); });
    EXPECT_EQ(code, ErrorCode::usage);
    EXPECT_NE(message.find(which), std::string::npos) << message;
    EXPECT_NE(message.find(devices[0].name), std::string::npos) << message;
  }
}

TEST(Vulkan, TimesKernels) {
  DeviceOptions options = validated();
  options.timing = true;
  VulkanExecutor executor("", options);
  constexpr int count = 1 << 20, block = 64;
  const auto counts = executor.allocate(4 * count, "counts");
  const std::vector<std::uint32_t> ones(count, 1);
  executor.write(*counts, 0, ones.data(), 4 * ones.size());
  const auto blocks = executor.allocate(4 * block_words * (count / block), "blocks");
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; i++) count_blocks(executor, counts.get(), blocks.get(), count, block);
  executor.finish();
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto times = executor.kernel_times();
  ASSERT_EQ(times.size(), 1u);
  EXPECT_EQ(times[0].kernel, "count_blocks");
  EXPECT_EQ(times[0].launches, 100u);
  EXPECT_GT(times[0].seconds, 0.0);
  EXPECT_LE(times[0].seconds, elapsed);
}

// More buffers than push constants have room for: their addresses come by a table.
void expect_many_buffers(Executor& device) {
  Executor* const executor = &device;
  constexpr int many = 40, points = 5;
  BufferGroup group;
  std::vector<std::string> names;
  std::vector<std::unique_ptr<DeviceBuffer>> buffers;
  std::string sum = "0";
  for (int i = 0; i < many; i++) {
    names.push_back(fmt::format("part{}", i));
    const std::int32_t value = 1000 + i;
    buffers.push_back(executor->allocate(4, "a part"));
    executor->write(*buffers.back(), 0, &value, 4);
    sum += fmt::format(" + {} * load_uniform_integer(buffers.{}, 0)", i + 1, names.back());
  }
  for (int i = 0; i < many; i++) group.push_back({names[std::size_t(i)], buffers[std::size_t(i)].get()});
  const std::string surface =
      "STRUCT(Surface) { int sum; };\nFN Surface surface_open(SurfaceBuffers buffers) {\n  Surface s;\n  s.sum = " +
      sum +
      ";\n  return s;\n}\nFN void surface_nearest_to(Surface s, Buffer points, Buffer coordinates, integer item, int "
      "end) "
      "{\n  store_integer(coordinates, item, item + splat_integer(s.sum), item < end);\n}\n";
  const Program program{KernelId::find_nearest, {{"surface", surface}}, {}, {{"surface", names}}};
  std::int32_t expected = 0;
  for (int i = 0; i < many; i++) expected += (i + 1) * (1000 + i);
  for (int round = 0; round < 3; round++) {
    TypedBuffer<std::int32_t> out(*executor, points, "sums");
    launch(*executor, program, arguments::find_nearest{.surface = group, .coordinates = out.get(), .end = points},
           points);
    std::vector<std::int32_t> found(points);
    out.read(found);
    for (int i = 0; i < points; i++) EXPECT_EQ(found[std::size_t(i)], expected + i);
  }
  executor->finish();
}
TEST(Vulkan, KernelsTakeManyBuffers) {
  expect_many_buffers(*open_vulkan("", validated()));
  expect_many_buffers(*open_opencl("", {}));
}

TEST(Vulkan, ValidationMessagesBecomeErrors) {
  vulkan::Messages messages;
  EXPECT_NO_THROW(messages.check());
  messages.add("first");
  messages.add("second");
  const auto [code, message] = error_of([&] { messages.check(); });
  EXPECT_EQ(code, ErrorCode::device);
  EXPECT_NE(message.find("first"), std::string::npos) << message;
  EXPECT_NO_THROW(messages.check());
  // And the layer is really there: a buffer of no size is an error of the caller.
  vulkan::Context context("", validated());
  try {
    const vk::raii::Buffer buffer(context.device(),
                                  vk::BufferCreateInfo({}, 0, vk::BufferUsageFlagBits::eStorageBuffer));
  } catch (const vk::Error&) {
    // The driver may refuse it as well.
  }
  EXPECT_EQ(error_of([&] { context.check_messages(); }).first, ErrorCode::device);
}

TEST(Vulkan, SaysWhereAShaderDoesNotCompile) {
  const std::string source = "#version 450\nlayout(local_size_x = 1) in;\nvoid main() {\n  int a = undeclared;\n}\n";
  const auto [code, message] = error_of([&] { vulkan::compile_glsl(source, "find_hits", {}); });
  EXPECT_EQ(code, ErrorCode::device);
  EXPECT_NE(message.find("find_hits"), std::string::npos) << message;
  EXPECT_NE(message.find("undeclared"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

}  // namespace
}  // namespace smurf
