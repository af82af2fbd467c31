#include "cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace smurf {

Progress::Progress(std::string label, bool quiet)
    : label_(std::move(label)), enabled_(!quiet && isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

std::function<void(std::size_t, std::size_t)> Progress::callback() {
  if (!enabled_) return {};
  return [this](std::size_t done, std::size_t total) { show(done, total); };
}

void Progress::show(std::size_t done, std::size_t total) {
  using std::chrono::duration, std::chrono::milliseconds;
  const auto now = Clock::now();
  if (total == 0 || now - start_ < milliseconds(500) || now - last_ < milliseconds(100)) return;
  last_ = now;
  shown_ = true;
  const double elapsed = duration<double>(now - start_).count();
  const double share = double(done) / double(total);
  const double left = share > 0 ? elapsed * (1 - share) / share : 0;
  fmt::print(stderr, "\r\033[K{}: {:.0f} %, {:.0f} s left", label_, 100 * share, left);
  std::fflush(stderr);
}

}  // namespace smurf
