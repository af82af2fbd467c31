// The verb `bench`: throughput on every device found.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace smurf {

struct BenchOptions {
  std::string filter;                // only workloads whose name contains this; empty: all
  std::filesystem::path json;        // results are written here too; empty: only printed
  std::vector<std::string> devices;  // names as for open_device; empty: every device found
  bool quiet = false;                // no progress
};

// The exit code. Throws Error.
int run_bench(const BenchOptions& options);

}  // namespace smurf
