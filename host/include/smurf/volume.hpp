// Volumes: scalar samples on a regular grid.
//
// Sample (i, j, k) lies at origin + axes * (i, j, k); i runs fastest in memory. The volume's domain
// is the hull of its nodes. Samples keep their own type; NaN and infinite samples are allowed and
// mean that there is no surface within their reach.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string_view>
#include <type_traits>

namespace smurf {

enum class SampleType { uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32, float64 };

std::size_t size_of(SampleType type);
const char* name_of(SampleType type);

template <class T>
constexpr SampleType sample_type_of() {
  if constexpr (std::is_same_v<T, std::uint8_t>) return SampleType::uint8;
  else if constexpr (std::is_same_v<T, std::int8_t>) return SampleType::int8;
  else if constexpr (std::is_same_v<T, std::uint16_t>) return SampleType::uint16;
  else if constexpr (std::is_same_v<T, std::int16_t>) return SampleType::int16;
  else if constexpr (std::is_same_v<T, std::uint32_t>) return SampleType::uint32;
  else if constexpr (std::is_same_v<T, std::int32_t>) return SampleType::int32;
  else if constexpr (std::is_same_v<T, std::uint64_t>) return SampleType::uint64;
  else if constexpr (std::is_same_v<T, std::int64_t>) return SampleType::int64;
  else if constexpr (std::is_same_v<T, float>) return SampleType::float32;
  else {
    static_assert(std::is_same_v<T, double>, "not a sample type");
    return SampleType::float64;
  }
}

// Where the samples lie in the world. Columns of `axes` are the steps from one sample to the next
// along i, j and k; they must be finite and linearly independent.
struct GridPlacement {
  glm::dmat3 axes{1.0};
  glm::dvec3 origin{0.0};
};

inline GridPlacement spacing(double x, double y, double z) {
  return {glm::dmat3(x, 0, 0, 0, y, 0, 0, 0, z), glm::dvec3(0.0)};
}

// Immutable; copies share the samples.
class Volume {
 public:
  // The samples are kept alive by `samples` and not copied.
  // Throws Error (input) on sizes below 1, on a placement that is singular or not finite.
  Volume(std::shared_ptr<const void> samples, SampleType type, glm::ivec3 size, const GridPlacement& placement);

  glm::ivec3 size() const { return size_; }
  std::size_t count() const { return std::size_t(size_.x) * std::size_t(size_.y) * std::size_t(size_.z); }
  SampleType type() const { return type_; }
  const void* samples() const { return samples_.get(); }
  std::size_t bytes() const { return count() * size_of(type_); }
  const GridPlacement& placement() const { return placement_; }

  // One sample as double.
  double at(std::size_t index) const;

  // Over the finite samples (0, 0 when there is none), and how many are NaN or infinite.
  // Computed when first asked for.
  double minimum() const;
  double maximum() const;
  std::size_t non_finite() const;

 private:
  struct Statistics;
  const Statistics& statistics() const;

  std::shared_ptr<const void> samples_;
  SampleType type_;
  glm::ivec3 size_;
  GridPlacement placement_;
  std::shared_ptr<Statistics> statistics_;
};

// A volume over the caller's memory, which must outlive every copy of the volume and every
// interrogator made from it. No sample is copied on the host, nor for a device that shares host memory.
// samples.size() must be size.x * size.y * size.z.
Volume borrow_volume(std::span<const std::byte> samples, SampleType type, glm::ivec3 size,
                     const GridPlacement& placement = {});

template <class T>
Volume borrow_volume(std::span<const T> samples, glm::ivec3 size, const GridPlacement& placement = {}) {
  return borrow_volume(std::as_bytes(samples), sample_type_of<T>(), size, placement);
}

// Reads a volume from a file: NRRD (.nrrd, or .nhdr with its data file), MetaImage (.mha, or .mhd with its data file),
// NIfTI (.nii, .nii.gz), and, where smurf was built with VTK, regular grids of VTK's (.vti, .vtk). `array` names the
// scalars in a VTK file; without it they are the only array of one component there. Its values of cells are brought to
// the nodes, each the mean of the cells about it.
// Throws Error (input): missing or truncated file, not three-dimensional, sizes that disagree with the data,
// zero or negative spacing, singular directions, no such array.
Volume load_volume(const std::filesystem::path& file, std::string_view array = {});

// The test signal of Marschner and Lobb (Visualization 1994, eq. 3): f_M = 6, alpha = 1/4, sampled at
// size³ nodes on [-1, 1]³ as float.
Volume marschner_lobb_volume(int size);

}  // namespace smurf
