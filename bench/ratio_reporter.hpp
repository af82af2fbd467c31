// Passes results on to Google Benchmark's own reporter, of the statistics only the median, and prints at the end how
// the rates of one workload relate: each smurf configuration to each peer measured in the same run.
#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace smurf::bench {

class RatioReporter : public benchmark::BenchmarkReporter {
 public:
  RatioReporter();
  bool ReportContext(const Context& context) override;
  void ReportRuns(const std::vector<Run>& runs) override;
  void Finalize() override;

 private:
  struct Entry {
    std::string who;         // "opencl:0/lanes:16", "embree-single"
    double rate, core_rate;  // per second, and per second of processor time; medians
  };
  std::unique_ptr<benchmark::BenchmarkReporter> inner_;
  std::map<std::string, std::vector<Entry>> rates_;  // by "workload/size"
};

// What follows "workload/size/" in a peer's name starts with this.
bool is_peer(const std::string& who);

}  // namespace smurf::bench
