// Memory for results and for buffers of devices: blocks of many pages are kept when they are given back. A program that
// asks for batch after batch gets the same pages again; fresh ones would have to be cleared by the system first, which
// takes longer than writing the hits of a mesh. Large blocks stand on large pages where the system offers them, and
// while they are kept it may take them back whenever it is short of memory.
#include "smurf/values.hpp"

#include <sys/mman.h>

#include <cstdint>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace smurf {
namespace {

constexpr std::size_t small_page = 4096;
constexpr std::size_t large_page = std::size_t(2) << 20;
constexpr std::size_t small = 32 * small_page;
constexpr std::size_t large = 2 * large_page;
constexpr std::size_t alignment = 64;  // a cache line, and what devices that share host memory like
constexpr std::size_t most_slack = 2;  // how many times as large as what is asked for a kept block may be

constexpr std::size_t rounded_up(std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; }

void* fresh(std::size_t bytes, std::size_t unit) {
  void* memory = std::aligned_alloc(unit, bytes);
  if (!memory) throw std::bad_alloc();
  return memory;
}

// Blocks of one kind, whole pages each.
class KeptBlocks {
 public:
  // `lent`: the system may take kept blocks back. What it has marked for that costs time again when it is written to.
  KeptBlocks(std::size_t page, std::size_t most_kept, bool lent) : page_(page), most_kept_(most_kept), lent_(lent) {}

  void* take(std::size_t size) {
    const std::size_t bytes = rounded_up(size, page_);
    const std::lock_guard lock(mutex_);
    const auto best = best_fit(bytes);
    if (best != kept_.end()) {
      const Block block = *best;
      used_.emplace(block.memory, block.bytes);
      kept_bytes_ -= block.bytes;
      kept_.erase(best);
      return block.memory;
    }
    void* memory = fresh(bytes, page_);
    try {
      used_.emplace(memory, bytes);
    } catch (...) {
      std::free(memory);
      throw;
    }
    // Advice only: without large pages everything works the same.
    if (page_ == large_page) madvise(memory, bytes, MADV_HUGEPAGE);
    return memory;
  }

  // Whether it was one of these.
  bool give_back(void* memory) {
    if (!memory || reinterpret_cast<std::uintptr_t>(memory) % page_ != 0) return false;
    const std::lock_guard lock(mutex_);
    const auto used = used_.find(memory);
    if (used == used_.end()) return false;
    const Block block = {memory, used->second};
    used_.erase(used);
    if (!keep(block)) std::free(memory);
    return true;
  }

 private:
  struct Block {
    void* memory;
    std::size_t bytes;
  };

  std::vector<Block>::iterator best_fit(std::size_t bytes) {
    auto best = kept_.end();
    for (auto block = kept_.begin(); block != kept_.end(); ++block) {
      const bool fits = block->bytes >= bytes && block->bytes / most_slack <= bytes;
      if (fits && (best == kept_.end() || block->bytes < best->bytes)) best = block;
    }
    return best;
  }

  // In place of those that were kept longest.
  bool keep([[maybe_unused]] Block block) {
#if defined(__SANITIZE_ADDRESS__)
    return false;  // a block that is used after it was given back is to be found out
#else
    if (block.bytes > most_kept_) return false;
    auto newer = kept_.begin();
    for (; kept_bytes_ + block.bytes > most_kept_; ++newer) {
      kept_bytes_ -= newer->bytes;
      std::free(newer->memory);
    }
    kept_.erase(kept_.begin(), newer);
    try {
      kept_.push_back(block);
    } catch (const std::bad_alloc&) {
      return false;
    }
    kept_bytes_ += block.bytes;
    if (lent_) madvise(block.memory, block.bytes, MADV_FREE);
    return true;
#endif
  }

  const std::size_t page_, most_kept_;
  const bool lent_;
  std::mutex mutex_;
  std::vector<Block> kept_;  // in the order in which they were given back
  std::size_t kept_bytes_ = 0;
  std::unordered_map<void*, std::size_t> used_;
};

// Never destroyed: results may outlive everything else.
KeptBlocks& small_blocks() {
  static KeptBlocks& blocks = *new KeptBlocks(small_page, std::size_t(64) << 20, false);
  return blocks;
}
KeptBlocks& large_blocks() {
  static KeptBlocks& blocks = *new KeptBlocks(large_page, std::size_t(512) << 20, true);
  return blocks;
}

}  // namespace

void* allocate_results(std::size_t bytes) {
  if (bytes >= large) return large_blocks().take(bytes);
  if (bytes >= small) return small_blocks().take(bytes);
  return fresh(rounded_up(bytes == 0 ? 1 : bytes, alignment), alignment);
}

void free_results(void* memory) noexcept {
  if (large_blocks().give_back(memory) || small_blocks().give_back(memory)) return;
  std::free(memory);
}

}  // namespace smurf
