// What readers of volumes share.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "smurf/volume.hpp"

namespace smurf {

// Sizes as a header has them. Throws Error (input) that names the file unless they are whole numbers of 1 or more, with
// 2^31-1 nodes at most.
glm::ivec3 checked_size(const std::filesystem::path& file, double x, double y, double z);

// In place, of `count` samples.
void swap_bytes(void* samples, SampleType type, std::size_t count);

// Owns memory from allocate_results.
std::shared_ptr<void> own_samples(void* samples);

}  // namespace smurf
