#include "workloads/measure.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

namespace smurf::workloads {
namespace {

double seconds_of(const std::function<void()>& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

std::map<std::string, double> kernel_seconds(const Device& device) {
  std::map<std::string, double> seconds;
  for (const KernelTime& time : device.kernel_times()) seconds[time.kernel] += time.seconds;
  return seconds;
}

// Time per kernel of one call, the mean of three after a warm-up.
void time_kernels(const std::string& name, DeviceOptions options, const Task& task, Measurement& measurement) {
  constexpr int calls = 3;
  options.timing = true;
  const Device device = open_device(name, options);
  if (device.is_reference()) return;
  const Interrogator interrogator(device, task.surface());
  ask(interrogator, task);
  const auto before = kernel_seconds(device);
  for (int i = 0; i < calls; i++) ask(interrogator, task);
  for (const auto& [kernel, seconds] : kernel_seconds(device)) {
    const auto earlier = before.find(kernel);
    const double spent = (seconds - (earlier == before.end() ? 0 : earlier->second)) / calls;
    if (spent <= 0) continue;
    measurement.kernels[kernel] = spent;
    measurement.kernel_seconds += spent;
  }
}

nlohmann::json json_of(const Spread& spread) {
  return {{"median", spread.median}, {"p99", spread.p99}, {"worst", spread.worst}};
}

}  // namespace

double core_seconds() {
  timespec spent{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
  return double(spent.tv_sec) + 1e-9 * double(spent.tv_nsec);
}

Task::Task(const Workload& workload, int size) : workload_(workload), size_(size), surface_(workload.surface()) {
  if (workload_.casts()) {
    rays_ = rays_of(workload_, surface_, size);
  } else {
    points_ = points_of(surface_, size);
  }
}

const ReferenceAnswers& Task::reference(const std::vector<std::size_t>& hit_rays) {
  if (!reference_) {
    const Interrogator interrogator(open_device("reference"), surface_);
    if (workload_.casts()) {
      reference_.emplace(workload_, interrogator, rays_, hit_rays);
    } else {
      reference_.emplace(workload_, interrogator, points_);
    }
  }
  return *reference_;
}

Verdict Task::judge(const HitList& hits) {
  std::vector<std::size_t> hit_rays;
  for (std::size_t i = 0; i < hits.ray_count(); i++)
    if (hits.offsets()[i + 1] > hits.offsets()[i]) hit_rays.push_back(i);
  return reference(hit_rays).judge(hits);
}

Verdict Task::judge(const PointProperties& answers) { return reference().judge(answers); }

Answers ask(const Interrogator& interrogator, const Task& task) {
  Answers answers;
  if (task.workload().casts()) {
    answers.hits = interrogator.cast(task.rays(), task.workload().cast_options());
  } else {
    answers.points = interrogator.probe(task.points(), task.workload().properties);
  }
  return answers;
}

void count_hits(const HitList& hits, Measurement& measurement) {
  measurement.hits = hits.size();
  measurement.hit_rays = measurement.flagged_rays = 0;
  for (std::size_t i = 0; i < hits.ray_count(); i++) {
    const std::size_t begin = hits.offsets()[i], end = hits.offsets()[i + 1];
    measurement.hit_rays += end > begin;
    bool flagged = false;
    for (std::size_t k = begin; k < end; k++) flagged = flagged || hits.status()[k] != HitStatus::isolated;
    measurement.flagged_rays += flagged;
  }
}

void time_runs(const Budget& budget, const std::function<void()>& body, Measurement& measurement) {
  body();
  std::vector<double> times, core_times;
  double spent = 0;
  while (times.size() < budget.runs || (spent < budget.seconds && times.size() < budget.most_runs)) {
    const double core_start = core_seconds();
    times.push_back(seconds_of(body));
    core_times.push_back(core_seconds() - core_start);
    spent += times.back();
  }
  measurement.runs = times.size();
  measurement.best_seconds = std::ranges::min(times);
  measurement.median_seconds = median(times);
  measurement.core_seconds = median(core_times);
}

int fitting_size(const Device& device, const Workload& workload, int size, const Budget& budget) {
  // A pilot of an eighth of the image width, or of an eighth of the points, tells the rate.
  const int pilot_size = std::max(1, size / 8);
  const Task pilot(workload, pilot_size);
  const Interrogator interrogator(device, pilot.surface());
  ask(interrogator, pilot);
  const double rate = double(pilot.count()) / seconds_of([&] { ask(interrogator, pilot); });
  auto fits = [&](int candidate) {
    return double(workload.count(candidate)) / rate * double(budget.runs + 1) <= budget.most_seconds;
  };
  while (size > pilot_size && !fits(size)) size /= workload.casts() ? 2 : 8;
  return std::max(size, pilot_size);
}

Measurement measure(const std::string& name, const DeviceOptions& options, Task& task, const Budget& budget) {
  Measurement measurement;
  {
    const Device device = open_device(name, options);
    const DeviceInfo& info = device.info();
    measurement.workload = task.workload().name;
    measurement.device = device.is_reference() ? info.executor : fmt::format("{}:{}", info.executor, info.index);
    measurement.name = info.name;
    measurement.lanes = info.lanes;
    measurement.size = task.size();
    measurement.count = task.count();
    std::optional<Interrogator> interrogator;
    measurement.set_up_seconds = seconds_of([&] { interrogator.emplace(device, task.surface()); });
    measurement.device_bytes = interrogator->device_bytes();
    Answers answers;
    time_runs(
        budget, [&] { answers = ask(*interrogator, task); }, measurement);
    measurement.compile_seconds = device.compile_seconds();
    measurement.programs_compiled = device.programs_compiled();
    measurement.programs_from_cache = device.programs_from_cache();
    if (answers.hits) count_hits(*answers.hits, measurement);
    measurement.verdict = answers.hits ? task.judge(*answers.hits) : task.judge(answers.points);
    measurement.reference_rate = task.reference().rate();
  }
  time_kernels(name, options, task, measurement);
  return measurement;
}

void to_json(nlohmann::json& json, const Measurement& m) {
  const Verdict& v = m.verdict;
  json = {{"workload", m.workload},
          {"size", m.size},
          {"count", m.count},
          {"device", m.device},
          {"name", m.name},
          {"lanes", m.lanes},
          {"runs", m.runs},
          {"set_up_seconds", m.set_up_seconds},
          {"compile_seconds", m.compile_seconds},
          {"programs_compiled", m.programs_compiled},
          {"programs_from_cache", m.programs_from_cache},
          {"median_seconds", m.median_seconds},
          {"best_seconds", m.best_seconds},
          {"core_seconds", m.core_seconds},
          {"rate_per_core_second", m.core_rate()},
          {"rate_per_second", m.rate()},
          {"kernel_seconds", m.kernel_seconds},
          {"kernels", m.kernels},
          {"reference_rate_per_second", m.reference_rate},
          {"hits", m.hits},
          {"hit_rays", m.hit_rays},
          {"flagged_rays", m.flagged_rays},
          {"flagged_fraction", m.flagged_fraction()},
          {"device_bytes", m.device_bytes},
          {"check",
           {{"sampled", v.sampled},
            {"expected_hits", v.expected_hits},
            {"missed", v.missed},
            {"invented", v.invented},
            {"excused", v.excused},
            {"t_error_voxels", json_of(v.t)},
            {"value_error", json_of(v.value)},
            {"normal_error_radians", json_of(v.normal)},
            {"curvature_error_relative", json_of(v.curvature)}}}};
  if (v.worst_ray) json["check"]["worst"] = *v.worst_ray;
}

nlohmann::json machine_description() {
  nlohmann::json machine;
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (!line.starts_with("model name") || colon == std::string::npos) continue;
    machine["processor"] = line.substr(colon + 2);
    break;
  }
  machine["threads"] = std::thread::hardware_concurrency();
  const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0) machine["memory_bytes"] = std::size_t(pages) * std::size_t(page);
  utsname system{};
  if (::uname(&system) == 0)
    machine["system"] = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  machine["compiler"] = __VERSION__;
  machine["devices"] = nlohmann::json::array();
  for (const DeviceInfo& info : list_devices()) {
    machine["devices"].push_back({{"device", fmt::format("{}:{}", info.executor, info.index)},
                                  {"name", info.name},
                                  {"platform", info.platform},
                                  {"memory_bytes", info.memory},
                                  {"precision", info.precision},
                                  {"lanes", info.lanes}});
  }
  return machine;
}

}  // namespace smurf::workloads
