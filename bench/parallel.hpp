// A plain parallel loop for the peers: all hardware threads take chunks of a range in turn.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace smurf::bench {

inline unsigned thread_count() { return std::max(1u, std::thread::hardware_concurrency()); }

// Calls body(thread, begin, end) for chunks that cover [0, count).
template <class Body>
void parallel_chunks(std::size_t count, std::size_t chunk, const Body& body) {
  std::atomic<std::size_t> next{0};
  auto work = [&](unsigned thread) {
    for (std::size_t begin; (begin = next.fetch_add(chunk)) < count;)
      body(thread, begin, std::min(count, begin + chunk));
  };
  std::vector<std::jthread> others;
  for (unsigned thread = 1; thread < thread_count(); thread++) others.emplace_back(work, thread);
  work(0);
}

}  // namespace smurf::bench
