// Volumes: checks on construction, statistics on demand, and the test signal of Marschner and Lobb.
#include "smurf/volume.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <vector>

#include "fields/placement.hpp"
#include "smurf/error.hpp"
#include "smurf/values.hpp"

namespace smurf {
namespace {

constexpr std::size_t greatest_count = std::numeric_limits<std::int32_t>::max();  // devices index with 32-bit integers

// Calls `function` with a value of the type that `type` names.
template <class Function>
auto with_type(SampleType type, Function&& function) {
  switch (type) {
    case SampleType::uint8:  // NOLINT(bugprone-branch-clone): the branches differ in type
      return function(std::uint8_t());
    case SampleType::int8:
      return function(std::int8_t());
    case SampleType::uint16:
      return function(std::uint16_t());
    case SampleType::int16:
      return function(std::int16_t());
    case SampleType::uint32:
      return function(std::uint32_t());
    case SampleType::int32:
      return function(std::int32_t());
    case SampleType::uint64:
      return function(std::uint64_t());
    case SampleType::int64:
      return function(std::int64_t());
    case SampleType::float32:
      return function(float());
    case SampleType::float64:
      return function(double());
  }
  throw Error(ErrorCode::input, fmt::format("volume: {} is no sample type", int(type)));
}

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, "volume: " + message); }

void check_size(const glm::ivec3& size) {
  if (size.x < 1 || size.y < 1 || size.z < 1)
    fail(fmt::format("a size of {} x {} x {} samples; each must be at least 1", size.x, size.y, size.z));
  const double count = double(size.x) * double(size.y) * double(size.z);
  if (count > double(greatest_count))
    fail(fmt::format("{} x {} x {} are {:.0f} samples; at most {} (2^31-1) are possible", size.x, size.y, size.z, count,
                     greatest_count));
}

}  // namespace

std::size_t size_of(SampleType type) {
  return with_type(type, [](auto sample) { return sizeof sample; });
}

const char* name_of(SampleType type) {
  static constexpr const char* names[] = {"uint8", "int8",   "uint16", "int16",   "uint32",
                                          "int32", "uint64", "int64",  "float32", "float64"};
  return names[int(type)];
}

struct Volume::Statistics {
  std::once_flag computed;
  double minimum = 0, maximum = 0;
  std::size_t non_finite = 0;

  template <class T>
  void compute(const T* samples, std::size_t count) {
    T least = std::numeric_limits<T>::max(), greatest = std::numeric_limits<T>::lowest();
    std::size_t finite = 0;
    for (std::size_t i = 0; i < count; i++) {
      const T value = samples[i];
      if constexpr (std::is_floating_point_v<T>) {
        const bool is_finite = std::abs(value) <= std::numeric_limits<T>::max();
        finite += is_finite;
        least = is_finite && value < least ? value : least;
        greatest = is_finite && value > greatest ? value : greatest;
      } else {
        least = std::min(least, value);
        greatest = std::max(greatest, value);
        finite++;
      }
    }
    non_finite = count - finite;
    if (finite == 0) return;
    minimum = double(least);
    maximum = double(greatest);
  }
};

Volume::Volume(std::shared_ptr<const void> samples, SampleType type, glm::ivec3 size, const GridPlacement& placement)
    : samples_(std::move(samples)),
      type_(type),
      size_(size),
      placement_(placement),
      statistics_(std::make_shared<Statistics>()) {
  check_size(size_);
  require_placement(placement_, "volume");
  size_of(type_);  // throws on an enumerator that does not exist
  if (samples_ == nullptr) fail("no samples were given");
}

double Volume::at(std::size_t index) const {
  return with_type(type_, [&](auto sample) { return double(static_cast<const decltype(sample)*>(samples())[index]); });
}

const Volume::Statistics& Volume::statistics() const {
  std::call_once(statistics_->computed, [this] {
    with_type(type_,
              [this](auto sample) { statistics_->compute(static_cast<const decltype(sample)*>(samples()), count()); });
  });
  return *statistics_;
}

double Volume::minimum() const { return statistics().minimum; }
double Volume::maximum() const { return statistics().maximum; }
std::size_t Volume::non_finite() const { return statistics().non_finite; }

Volume borrow_volume(std::span<const std::byte> samples, SampleType type, glm::ivec3 size,
                     const GridPlacement& placement) {
  check_size(size);
  const std::size_t count = std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
  if (samples.size() != count * size_of(type))
    fail(fmt::format("{} x {} x {} samples of {} take {} bytes, but {} were given", size.x, size.y, size.z,
                     name_of(type), count * size_of(type), samples.size()));
  if (reinterpret_cast<std::uintptr_t>(samples.data()) % size_of(type) != 0)
    fail(fmt::format("the samples must be aligned to {} bytes", size_of(type)));
  // An aliasing pointer without an owner: the caller keeps the memory.
  return Volume(std::shared_ptr<const void>(std::shared_ptr<const void>(), samples.data()), type, size, placement);
}

Volume marschner_lobb_volume(int size) {
  if (size < 2) fail(fmt::format("Marschner-Lobb needs at least 2 samples along each axis, not {}", size));
  check_size(glm::ivec3(size));
  constexpr double frequency = 6.0, alpha = 0.25, pi = std::numbers::pi;
  const auto n = std::size_t(size);
  const double step = 2.0 / (size - 1);
  const auto samples = std::make_shared<Values<float>>(n * n * n);
  std::vector<double> rings(n * n);  // what depends on x and y only
  for (std::size_t j = 0; j < n; j++) {
    for (std::size_t i = 0; i < n; i++) {
      const double x = -1.0 + step * double(i), y = -1.0 + step * double(j);
      const double rho = std::cos(2.0 * pi * frequency * std::cos(0.5 * pi * std::sqrt(x * x + y * y)));
      rings[i + n * j] = alpha * (1.0 + rho);
    }
  }
  for (std::size_t k = 0; k < n; k++) {
    const double slab = 1.0 - std::sin(0.5 * pi * (-1.0 + step * double(k)));
    for (std::size_t p = 0; p < n * n; p++)
      (*samples)[p + n * n * k] = float((slab + rings[p]) / (2.0 * (1.0 + alpha)));
  }
  GridPlacement placement = spacing(step, step, step);
  placement.origin = glm::dvec3(-1.0);
  return Volume(std::shared_ptr<const void>(samples, samples->data()), SampleType::float32, glm::ivec3(size),
                placement);
}

}  // namespace smurf
