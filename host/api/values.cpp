// Memory for results: large blocks stand on large pages where the system offers them, and are kept when they are given back. A program that
// asks for batch after batch gets the same pages again; fresh ones would have to be cleared by the system first, which takes longer than
// writing the hits of a mesh. The system may take kept pages back whenever it is short of memory.
#include "smurf/values.hpp"

#include <sys/mman.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <unordered_map>

namespace smurf {
namespace {

constexpr std::size_t large_page = std::size_t(2) << 20;
constexpr std::size_t large = 2 * large_page;
constexpr std::size_t alignment = 64;  // a cache line, and what devices that share host memory like
constexpr std::size_t most_kept = std::size_t(512) << 20;
constexpr std::size_t most_slack = 2;  // a kept block serves no request of less than this part of it

constexpr std::size_t rounded_up(std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; }

void* fresh(std::size_t bytes, std::size_t unit) {
  void* memory = std::aligned_alloc(unit, bytes);
  if (!memory) throw std::bad_alloc();
  return memory;
}

// Large blocks, by their sizes.
class LargeBlocks {
 public:
  void* take(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    const auto kept = kept_.lower_bound(bytes);
    if (kept != kept_.end() && kept->first <= most_slack * bytes) {
      void* memory = kept->second;
      used_.emplace(memory, kept->first);
      kept_bytes_ -= kept->first;
      kept_.erase(kept);
      return memory;
    }
    void* memory = fresh(bytes, large_page);
    try {
      used_.emplace(memory, bytes);
    } catch (...) {
      std::free(memory);
      throw;
    }
    // Advice only: without large pages everything works the same.
    madvise(memory, bytes, MADV_HUGEPAGE);
    return memory;
  }

  // Whether it was one of these.
  bool give_back(void* memory) {
    const std::lock_guard lock(mutex_);
    const auto used = used_.find(memory);
    if (used == used_.end()) return false;
    const std::size_t bytes = used->second;
    used_.erase(used);
    if (!keep(memory, bytes)) std::free(memory);
    return true;
  }

 private:
  bool keep(void* memory, std::size_t bytes) {
#if defined(__SANITIZE_ADDRESS__)
    // A block that is used after it was given back is to be found out.
    return false;
#endif
    // The largest go first: small ones serve more requests.
    while (!kept_.empty() && kept_bytes_ + bytes > most_kept && kept_.rbegin()->first >= bytes)
      drop(std::prev(kept_.end()));
    if (kept_bytes_ + bytes > most_kept) return false;
    try {
      kept_.emplace(bytes, memory);
    } catch (const std::bad_alloc&) {
      return false;
    }
    kept_bytes_ += bytes;
    madvise(memory, bytes, MADV_FREE);
    return true;
  }
  void drop(std::multimap<std::size_t, void*>::iterator block) {
    kept_bytes_ -= block->first;
    std::free(block->second);
    kept_.erase(block);
  }

  std::mutex mutex_;
  std::multimap<std::size_t, void*> kept_;
  std::unordered_map<void*, std::size_t> used_;
  std::size_t kept_bytes_ = 0;
};

// Never destroyed: results may outlive everything else.
LargeBlocks& large_blocks() {
  static LargeBlocks& blocks = *new LargeBlocks;
  return blocks;
}

}  // namespace

void* allocate_results(std::size_t bytes) {
  if (bytes >= large) return large_blocks().take(rounded_up(bytes, large_page));
  return fresh(rounded_up(bytes == 0 ? 1 : bytes, alignment), alignment);
}

void free_results(void* memory) noexcept {
  // Large blocks stand at the beginning of a large page, which few others do.
  if (reinterpret_cast<std::uintptr_t>(memory) % large_page == 0 && memory && large_blocks().give_back(memory)) return;
  std::free(memory);
}

}  // namespace smurf
