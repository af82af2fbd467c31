// The verb `bench`: every workload on every device that can be opened, beside the reference in the same run.
#include "cli/bench.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/session.hpp"
#include "io/atomic_file.hpp"
#include "smurf/error.hpp"
#include "workloads/measure.hpp"

namespace smurf {
namespace {

using namespace workloads;

// One line on standard error that is rewritten, while standard error is a terminal.
class StatusLine {
 public:
  explicit StatusLine(bool quiet) : shown_(!quiet && ::isatty(STDERR_FILENO) == 1) {}
  ~StatusLine() { show(""); }
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;
  void show(const std::string& text) const {
    if (shown_) fmt::print(stderr, "\r\033[K{}", text);
  }

 private:
  bool shown_;
};

std::vector<std::string> devices_to_measure(const BenchOptions& options) {
  if (!options.devices.empty()) return options.devices;
  std::vector<std::string> names;
  for (const DeviceInfo& info : list_devices())
    if (info.executor != "reference") names.push_back(fmt::format("{}:{}", info.executor, info.index));
  return names;
}

std::string error_text(bool measured, double error) {
  return !measured ? "-" : error > 0 ? fmt::format("{:.1e}", error) : "0";
}

std::string count_text(bool measured, std::size_t count) { return measured ? fmt::format("{}", count) : "-"; }

void print_header() {
  fmt::print(
      "{:<16} {:>8} {:<10} {:>5} {:>9} {:>9} {:>9} {:>9} {:>7} {:>8} {:>6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8}\n",
      "workload", "size", "device", "lanes", "M/s", "M/core-s", "kernels", "ref M/s", "x ref", "hits", "missed",
      "extra", "flagged", "t error", "n error", "k error", "MiB");
}

void print_row(const Measurement& m, const Workload& workload) {
  const bool casts = workload.casts();
  const bool bends = contains(workload.properties, Property::principal);
  const double kernels = m.kernel_seconds > 0 ? 1e-6 * double(m.count) / m.kernel_seconds : 0;
  fmt::print(
      "{:<16} {:>8} {:<10} {:>5} {:>9.4g} {:>9.4g} {:>9} {:>9.3g} {:>7.3g} {:>8} {:>6} {:>6} {:>8} {:>8} {:>8} {:>8} "
      "{:>8.1f}\n",
      m.workload, m.size, m.device, m.lanes, 1e-6 * m.rate(), 1e-6 * m.core_rate(),
      kernels > 0 ? fmt::format("{:.4g}", kernels) : "-", 1e-6 * m.reference_rate, m.rate() / m.reference_rate,
      count_text(casts, m.hits), count_text(casts, m.verdict.missed), count_text(casts, m.verdict.invented),
      error_text(casts, m.flagged_fraction()), error_text(true, casts ? m.verdict.t.worst : m.verdict.value.worst),
      error_text(true, m.verdict.normal.p99), error_text(bends, m.verdict.curvature.p99),
      double(m.device_bytes) / (1 << 20));
  std::fflush(stdout);
}

void print_legend() {
  fmt::print(
      "\nsize: pixels along a side of the square image, or number of points. M/s: million rays (points) a second of "
      "whole calls, median;\n"
      "kernels: the same for the time in kernels alone; ref: the double-precision reference on a sample of the same "
      "queries.\n"
      "missed, extra: hits on the sample that the device lacks, or has alone, outside of what it flags; flagged: "
      "fraction of all rays.\n"
      "t error: largest |t - reference| in voxels (probes: of the value, relative to the volume's range); k error: "
      "99th percentile,\n"
      "relative, of the principal curvatures. MiB: the surface on the device.\n");
}

}  // namespace

int run_bench(const BenchOptions& options) {
  const Catalogue list = catalogue(options.filter);
  if (list.workloads.empty() && list.missing.empty()) {
    std::string names;
    for (const Workload& workload : catalogue().workloads) names += (names.empty() ? "" : ", ") + workload.name;
    throw Error(ErrorCode::usage,
                fmt::format("no workload's name contains \"{}\"; there are {}", options.filter, names));
  }
  if (!options.json.empty()) check_output(options.json, {".json"});
  const std::vector<std::string> devices = devices_to_measure(options);
  for (const std::string& device : devices) open_device(device);  // a wrong name is told before the work begins
  if (devices.empty()) throw Error(ErrorCode::device, "no OpenCL or Vulkan device was found to measure");

  const Budget budget;
  const StatusLine status(options.quiet);
  nlohmann::json results = nlohmann::json::array(), missing = nlohmann::json::array();
  std::size_t wrong = 0, failed = 0;
  print_header();
  for (const Workload& workload : list.workloads) {
    std::map<int, std::unique_ptr<Task>> tasks;  // by size; devices share the reference's answers
    for (const std::string& device : devices) {
      int last_size = 0;
      for (int size : workload.sizes) {
        status.show(fmt::format("{} at {} on {} …", workload.name, size, device));
        try {
          size = fitting_size(open_device(device), workload, size, budget);
          if (size == last_size) continue;  // a slow device: both sizes came down to the same
          last_size = size;
          auto& task = tasks[size];
          if (!task) task = std::make_unique<Task>(workload, size);
          const Measurement measurement = measure(device, {}, *task, budget);
          status.show("");
          print_row(measurement, workload);
          wrong += measurement.verdict.missed + measurement.verdict.invented;
          results.push_back(measurement);
        } catch (const Error& error) {
          // One device that fails does not take the others' results with it; the exit code tells.
          status.show("");
          const std::string reason = fmt::format("at {} on {}: {}", size, device, error.what());
          fmt::print("{:<16} failed {}\n", workload.name, reason);
          missing.push_back({{"workload", workload.name}, {"reason", reason}});
          failed++;
        }
      }
    }
  }
  print_legend();
  for (const Missing& entry : list.missing) {
    fmt::print("not measured: {}: {}\n", entry.name, entry.reason);
    missing.push_back({{"workload", entry.name}, {"reason", entry.reason}});
  }
  if (!options.json.empty()) {
    nlohmann::json document = {{"machine", machine_description()}, {"results", results}, {"not_measured", missing}};
    write_file(options.json, document.dump(1) + "\n");
  }
  if (wrong > 0) {
    fmt::print(stderr, "smurf: {} hits on the checked samples differ from the reference\n", wrong);
  }
  if (failed > 0) fmt::print(stderr, "smurf: {} measurements failed\n", failed);
  return wrong > 0 || failed > 0 ? 1 : 0;
}

}  // namespace smurf
