// Benchmarks by name: what is set up for one is kept until the next one begins.
#pragma once

#include <functional>
#include <map>
#include <string>

namespace smurf::bench {

using Counters = std::map<std::string, double>;

// A benchmark that is set up: what a repetition runs, and what is told about it beside its time.
struct Ready {
  std::function<void()> run;
  std::size_t count = 0;
  std::string label;
  Counters counters;
};
using SetUp = std::function<Ready()>;

// Set up once, with one run as warm-up; then repetitions of whole calls.
void add(const std::string& name, const SetUp& set_up);

// W5: steps of streamlines (streamlines.cpp).
void add_streamlines();
// W5: stream surfaces (stream_surfaces.cpp).
void add_stream_surfaces();
// What coherence of rays and kept properties gain (coherence.cpp).
void add_coherence();
// W10: neighbours on surfaces (walks.cpp).
void add_walks();

}  // namespace smurf::bench
