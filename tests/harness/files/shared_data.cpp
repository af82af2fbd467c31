#include "harness/files/shared_data.hpp"

#include <cstdlib>

#include "harness/devices.hpp"

namespace smurf::test {

std::filesystem::path shared_data(const std::filesystem::path& path) {
  if (const char* named = std::getenv("SMURF_DATA")) return std::filesystem::path(named) / path;
  return std::filesystem::path(SMURF_SOURCE_DIR) / ".." / "shared" / "data" / path;
}

bool has_shared_data(const std::filesystem::path& path) {
  if (std::filesystem::exists(shared_data(path))) return true;
  report_missing(path.string() + " of $SMURF_DATA or of shared/data beside the sources");
  return false;
}

}  // namespace smurf::test
