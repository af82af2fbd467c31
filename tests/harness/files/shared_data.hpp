// Data of the development that are not in the repository: files below $SMURF_DATA, else below shared/data beside the
// sources.
#pragma once

#include <filesystem>

namespace smurf::test {

// Where a file or folder of them is, if it is at hand.
std::filesystem::path shared_data(const std::filesystem::path& path);
// Whether it is; where not, that is reported as missing (devices.hpp), and the test that needs it is skipped.
bool has_shared_data(const std::filesystem::path& path);

}  // namespace smurf::test
