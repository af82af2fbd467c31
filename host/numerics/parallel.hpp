// Plain data parallelism on the host: task(0) .. task(count-1) on all cores, in any order.
// Each task writes to its own place, so that results do not depend on the scheduling.
#pragma once

#include <cstddef>
#include <functional>

namespace smurf {

// Rethrows the first exception of a task after all threads have ended.
void parallel_for(std::size_t count, const std::function<void(std::size_t)>& task);

}  // namespace smurf
