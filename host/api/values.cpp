// Memory for results: large blocks stand on large pages where the system offers them.
#include "smurf/values.hpp"

#include <sys/mman.h>

namespace smurf {
namespace {

constexpr std::size_t large_page = std::size_t(2) << 20;
constexpr std::size_t alignment = 64;  // a cache line, and what devices that share host memory like

constexpr std::size_t rounded_up(std::size_t bytes, std::size_t unit) { return (bytes + unit - 1) / unit * unit; }

}  // namespace

void* allocate_results(std::size_t bytes) {
  const bool large = bytes >= 2 * large_page;
  const std::size_t unit = large ? large_page : alignment;
  void* memory = std::aligned_alloc(unit, rounded_up(bytes == 0 ? 1 : bytes, unit));
  if (!memory) throw std::bad_alloc();
  // Advice only: without large pages everything works the same.
  if (large) madvise(memory, rounded_up(bytes, unit), MADV_HUGEPAGE);
  return memory;
}

void free_results(void* memory) noexcept { std::free(memory); }

}  // namespace smurf
