// Properties of surface points on a device (kernels/batch/measure.inc): points and their columns stand on the host's
// memory where the device can use it, and are copied in tiles elsewhere.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "device/executor.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {

class PropertyMeasurement {
 public:
  // Compiles what measures; what finds nearest points is compiled when it is first launched, for few ask for it.
  PropertyMeasurement(Executor& executor, const ResidentSurface& surface, bool coordinates);

  // As SurfaceQueries::measure.
  void measure(ResidentSurface& surface, const PointSet& points, std::uint32_t wanted, const ProbeOptions& options,
               PointProperties& out);

 private:
  struct PointBuffers {
    DeviceBuffer *locations, *coordinates, *directions;
  };

  void launch_points(const PointBuffers& points, DeviceBuffer* columns, std::size_t first, std::size_t end,
                     std::size_t stride, std::uint32_t wanted);
  // Surface coordinates of the nearest points, in coordinates_.
  void find_nearest(DeviceBuffer* locations, std::size_t first, std::size_t end);
  // Measures points that are copied to the device, and copies their columns back to where they belong in `words`.
  void measure_copies(const PointSet& points, std::uint32_t wanted, std::size_t first, Values<std::uint32_t>& words);
  template <class T>
  void ensure(TypedBuffer<T>& buffer, std::size_t count, std::string_view purpose);
  // The values on the device, in `buffer`; null for none.
  template <class T>
  DeviceBuffer* copy(std::span<const T> values, TypedBuffer<T>& buffer, std::string_view purpose);
  // A buffer on the host's values; none for none.
  template <class T>
  std::unique_ptr<DeviceBuffer> share(std::span<const T> values, std::string_view purpose);

  Executor& executor_;
  const bool has_coordinates_;
  Program first_, second_, nearest_;  // without curvature, and with it
  BufferGroup surface_;
  TypedBuffer<glm::vec3> points_, directions_;
  TypedBuffer<SurfaceCoordinates> coordinates_;
  TypedBuffer<std::uint32_t> columns_;
};

}  // namespace smurf
