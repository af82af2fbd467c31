// Progress of long work, as one line on standard error that is rewritten in place and erased at the end.
// Nothing is shown when standard error is no terminal, when asked to be quiet, or before the first half second.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>

namespace smurf {

class Progress {
 public:
  Progress(std::string label, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // For CastOptions::progress and the like; empty when nothing is to be shown. Must not outlive this object.
  std::function<void(std::size_t done, std::size_t total)> callback();

 private:
  using Clock = std::chrono::steady_clock;

  void show(std::size_t done, std::size_t total);

  std::string label_;
  bool enabled_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
};

}  // namespace smurf
