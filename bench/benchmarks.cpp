#include "benchmarks.hpp"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <optional>

#include "smurf/error.hpp"
#include "workloads/measure.hpp"

namespace smurf::bench {
namespace {

using workloads::core_seconds;

constexpr int repetitions = 7;
constexpr double least_seconds = 0.1;  // of a repetition

// Set up once per benchmark, with one run as warm-up.
Ready& ready(const std::string& name, const SetUp& set_up) {
  static std::string current;
  static std::optional<Ready> kept;
  if (current != name || !kept) {
    kept.reset();
    kept = set_up();
    current = name;
  }
  return *kept;
}

}  // namespace

void add(const std::string& name, const SetUp& set_up) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [name, set_up](benchmark::State& state) {
                                 try {
                                   Ready& benchmark = ready(name, set_up);
                                   const double start = core_seconds();
                                   for ([[maybe_unused]] auto _ : state) benchmark.run();
                                   const double spent = core_seconds() - start;
                                   const double items = double(benchmark.count) * double(state.iterations());
                                   state.counters["items_per_core_second"] = items / spent;
                                   state.SetItemsProcessed(std::int64_t(benchmark.count) * state.iterations());
                                   state.SetLabel(benchmark.label);
                                   for (const auto& [key, value] : benchmark.counters) state.counters[key] = value;
                                 } catch (const Error& error) {
                                   state.SkipWithError(error.what());
                                 }
                               })
      ->MinTime(least_seconds)
      ->Repetitions(repetitions)
      ->ReportAggregatesOnly(true)
      ->DisplayAggregatesOnly(true)
      ->UseRealTime()
      ->Unit(benchmark::kMillisecond);
}

}  // namespace smurf::bench
