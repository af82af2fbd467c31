#include "io/volumes/samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "smurf/error.hpp"
#include "smurf/values.hpp"

namespace smurf {

glm::ivec3 checked_size(const std::filesystem::path& file, double x, double y, double z) {
  const double sizes[] = {x, y, z};
  constexpr double most = double(std::numeric_limits<std::int32_t>::max());
  for (const double size : sizes) {
    if (!(size >= 1 && size <= most && std::floor(size) == size))
      throw Error(ErrorCode::input,
                  fmt::format("\"{}\": sizes are {} {} {}; each must be at least 1", file.string(), x, y, z));
  }
  if (x * y * z > most)
    throw Error(ErrorCode::input, fmt::format("\"{}\": sizes {} {} {} are {:.0f} samples; at most 2^31-1 are possible",
                                              file.string(), x, y, z, x * y * z));
  return {int(x), int(y), int(z)};
}

void swap_bytes(void* samples, SampleType type, std::size_t count) {
  const std::size_t width = size_of(type);
  auto* bytes = static_cast<char*>(samples);
  for (std::size_t i = 0; i < count && width > 1; i++) std::reverse(bytes + i * width, bytes + (i + 1) * width);
}

std::shared_ptr<void> own_samples(void* samples) {
  return {samples, [](void* memory) { free_results(memory); }};
}

}  // namespace smurf
