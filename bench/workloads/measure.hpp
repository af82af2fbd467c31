// Throughput of a workload on a device, beside the reference in the same run, with the answers checked.
//
// What is timed is the whole call: queries in host memory to answers in host memory, properties included. One warm-up,
// then at least five runs, of which the median counts. Kernels alone are timed apart, on a device opened with timing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "smurf/device.hpp"
#include "workloads/validate.hpp"
#include "workloads/workloads.hpp"

namespace smurf::workloads {

// Queries of one workload at one size, and the reference's answers to a sample of them.
class Task {
 public:
  Task(const Workload& workload, int size);

  const Workload& workload() const { return workload_; }
  int size() const { return size_; }
  std::size_t count() const { return workload_.count(size_); }
  const Surface& surface() const { return surface_; }
  const RayBatch& rays() const { return rays_; }
  const std::vector<glm::vec3>& points() const { return points_; }

  // The reference's answers; `hit_rays` tells the first call which rays hit, so that the sample holds enough of them.
  const ReferenceAnswers& reference(const std::vector<std::size_t>& hit_rays = {});
  Verdict judge(const HitList& hits);
  Verdict judge(const PointProperties& answers);

 private:
  Workload workload_;
  int size_;
  Surface surface_;
  RayBatch rays_;
  std::vector<glm::vec3> points_;
  std::optional<ReferenceAnswers> reference_;
};

// The answers to a task, whichever kind it is.
struct Answers {
  std::optional<HitList> hits;
  PointProperties points;
};
Answers ask(const Interrogator& interrogator, const Task& task);

struct Measurement {
  std::string workload, device, name;
  int size = 0, lanes = 1;
  std::size_t count = 0;  // rays or points
  std::size_t runs = 0;
  double set_up_seconds = 0;   // upload, prefilter, bounds; programs compiled or read from the cache
  double compile_seconds = 0;  // part of it
  std::size_t programs_compiled = 0, programs_from_cache = 0;
  double median_seconds = 0, best_seconds = 0;
  double core_seconds = 0;    // processor time of one call on all cores of the host, median
  double kernel_seconds = 0;  // of one call; 0 where the device does not tell
  std::map<std::string, double> kernels;
  double reference_rate = 0;  // per second
  std::size_t hits = 0, hit_rays = 0, flagged_rays = 0;
  std::size_t device_bytes = 0;
  Verdict verdict;

  double rate() const { return double(count) / median_seconds; }
  double core_rate() const { return double(count) / core_seconds; }  // per second of one core; steady on a busy machine
  double flagged_fraction() const { return double(flagged_rays) / double(count); }
};
void to_json(nlohmann::json& json, const Measurement& measurement);

struct Budget {
  double seconds = 3;        // for the timed runs together, where runs are short
  double most_seconds = 12;  // for the fewest runs, where they are long: beyond it, the size is reduced
  std::size_t runs = 5;      // at least
  std::size_t most_runs = 25;
};

// Processor time that this process has spent so far on all cores.
double core_seconds();

// Counts in a batch's answer.
void count_hits(const HitList& hits, Measurement& measurement);

// Median and best over runs of `body`, after one warm-up that is not counted.
void time_runs(const Budget& budget, const std::function<void()>& body, Measurement& measurement);

// The greatest size, halved as often as needed from `size`, at which the runs fit the budget on this device. Points are
// divided by eight.
int fitting_size(const Device& device, const Workload& workload, int size, const Budget& budget);

// `device` is opened by name with these options.
Measurement measure(const std::string& device, const DeviceOptions& options, Task& task, const Budget& budget);

// Processor, memory, system and compiler, so that results can be read later.
nlohmann::json machine_description();

}  // namespace smurf::workloads
