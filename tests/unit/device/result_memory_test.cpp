// Memory for results: large blocks come again, none is handed out twice, and what is small or out of proportion is new.
#include "smurf/values.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <atomic>
#include <cstdint>
#include <cstring>
#include <thread>
#include <vector>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

constexpr std::size_t mebibyte = std::size_t(1) << 20;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool blocks_are_kept = false;  // so that the sanitizer sees what is used after it was given back
#else
constexpr bool blocks_are_kept = true;
#endif

// Whether there is memory at this place: blocks of this size that were not kept are the system's again.
bool is_there(void* memory) {
  unsigned char resident = 0;
  return mincore(memory, 4096, &resident) == 0;
}

TEST(Results, LargeBlocksComeAgain) {
  void* const first = allocate_results(64 * mebibyte);
  std::memset(first, 1, 64 * mebibyte);
  free_results(first);
  if (blocks_are_kept) {
    EXPECT_TRUE(is_there(first));
  }
  void* const again = allocate_results(50 * mebibyte);
  EXPECT_EQ(again == first, blocks_are_kept);
  std::memset(again, 2, 50 * mebibyte);
  free_results(again);
  // Its whole size is still known.
  void* const whole = allocate_results(64 * mebibyte);
  EXPECT_EQ(whole == first, blocks_are_kept);
  // None is handed out while it is in use, nor for much less than its size.
  void* const other = allocate_results(64 * mebibyte);
  EXPECT_NE(other, whole);
  free_results(whole);
  void* const small = allocate_results(5 * mebibyte);
  EXPECT_NE(small, whole);
  free_results(small);
  free_results(other);
}

// Of 1,200 MiB that are given back 512 MiB are kept at most, the latest.
TEST(Results, WhatIsKeptHasALimit) {
  std::vector<char*> blocks;
  for (int i = 0; i < 12; i++) {
    blocks.push_back(static_cast<char*>(allocate_results(100 * mebibyte)));
    blocks.back()[0] = blocks.back()[100 * mebibyte - 1] = char(i);
  }
  for (int i = 0; i < 12; i++) {
    EXPECT_EQ(blocks[std::size_t(i)][0], char(i));
    EXPECT_EQ(blocks[std::size_t(i)][100 * mebibyte - 1], char(i));
  }
  for (char* memory : blocks) free_results(memory);
  if (!blocks_are_kept) return;  // what becomes of them is the sanitizer's business
  for (std::size_t i = 0; i < 12; i++) EXPECT_EQ(is_there(blocks[i]), i >= 7) << "block " << i;
}

TEST(Results, BlocksAreAlignedAndNullIsNothing) {
  free_results(nullptr);
  for (std::size_t bytes :
       {std::size_t(0), std::size_t(1), std::size_t(4096), 3 * mebibyte, 4 * mebibyte, 9 * mebibyte + 1}) {
    void* const memory = allocate_results(bytes);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % 64, 0u) << bytes;
    std::memset(memory, 3, bytes);
    free_results(memory);
  }
}

TEST(Results, ThreadsDoNotShareBlocks) {
  std::atomic<int> mixed{0};
  parallel_for(4, [&](std::size_t task) {
    for (std::size_t round = 0; round < 50; round++) {
      const std::size_t count = (5 + (task + round) % 4) * mebibyte;
      auto* const bytes = static_cast<unsigned char*>(allocate_results(count));
      for (std::size_t i = 0; i < count; i += 65536) bytes[i] = static_cast<unsigned char>(task);
      std::this_thread::yield();
      for (std::size_t i = 0; i < count; i += 65536) mixed += bytes[i] != task;
      free_results(bytes);
    }
  });
  EXPECT_EQ(mixed, 0);
}

}  // namespace
}  // namespace smurf
