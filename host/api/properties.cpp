#include "api/properties.hpp"

#include <algorithm>
#include <limits>

#include "surfaces/property_columns.hpp"

namespace smurf {
namespace {

constexpr std::size_t points_in_tile = 1 << 20;

template <class T>
std::span<const T> stretch(std::span<const T> values, std::size_t first, std::size_t count) {
  return values.empty() ? values : values.subspan(first, count);
}

}  // namespace

PropertyMeasurement::PropertyMeasurement(Executor& executor, const ResidentSurface& surface, bool coordinates)
    : executor_(executor), has_coordinates_(coordinates) {
  const auto program = [&](const char* curvature) {
    Program p = surface.program(KernelId::measure);
    p.defines["COORDINATES"] = coordinates ? "1" : "0";
    p.defines["CURVATURE"] = curvature;
    executor_.prepare(p);
    return p;
  };
  first_ = program("0");
  second_ = program("1");
  nearest_ = surface.program(KernelId::find_nearest);
  nearest_.defines["COORDINATES"] = "1";
  nearest_.defines["CURVATURE"] = "0";
}

void PropertyMeasurement::measure(ResidentSurface& surface, const PointSet& points, std::uint32_t wanted,
                                  const ProbeOptions& options, PointProperties& out) {
  const std::size_t size = points.locations.size();
  surface.prepare_properties();
  surface_ = surface.buffers();
  const auto words = std::make_shared<Values<std::uint32_t>>(size * words_per_point(wanted));
  const std::size_t step = options.tile != 0 ? options.tile : points_in_tile;
  // Kernels count words in 32 bits.
  std::unique_ptr<DeviceBuffer> results;
  if (!words->empty() && words->size() <= std::size_t(std::numeric_limits<std::int32_t>::max()))
    results = executor_.share_results(words->data(), words->size() * sizeof(std::uint32_t), "properties");
  std::unique_ptr<DeviceBuffer> locations, coordinates, directions;
  if (results) {
    locations = share(points.locations, "points");
    coordinates = share(points.coordinates, "surface coordinates");
    directions = share(points.directions, "directions");
  }
  const bool find = has_coordinates_ && points.coordinates.empty();
  if (find && results) ensure(coordinates_, size, "surface coordinates");
  Values<SurfaceCoordinates> found(find && contains(wanted, Property::parameters) ? size : 0);
  for (std::size_t first = 0; first < size; first += step) {
    const std::size_t count = std::min(step, size - first);
    if (results) {
      if (find) find_nearest(locations.get(), first, first + count);
      launch_points({locations.get(), find ? coordinates_.get() : coordinates.get(), directions.get()}, results.get(),
                    first, first + count, size, wanted);
      if (options.progress) executor_.finish();
    } else {
      measure_copies({stretch(points.locations, first, count), stretch(points.coordinates, first, count),
                      stretch(points.directions, first, count)},
                     wanted, first, *words);
    }
    if (!found.empty()) coordinates_.read(std::span(found).subspan(first, count), results ? first : 0);
    if (options.progress) options.progress(first + count, size);
  }
  results.reset();
  take_columns(words, size, wanted, out);
  if (!found.empty()) out.coordinates = std::move(found);
}

void PropertyMeasurement::launch_points(const PointBuffers& points, DeviceBuffer* columns, std::size_t first,
                                        std::size_t end, std::size_t stride, std::uint32_t wanted) {
  const std::uint32_t second =
      Property::gauss | Property::mean | Property::principal | Property::directions | Property::normal_curvature;
  launch(executor_, (wanted & second) != 0 ? second_ : first_,
         arguments::measure{.surface = surface_,
                            .points = points.locations,
                            .coordinates = points.coordinates,
                            .directions = points.directions,
                            .columns = columns,
                            .first = int(first),
                            .end = int(end),
                            .stride = int(stride),
                            .wanted = int(wanted)},
         end - first);
}

void PropertyMeasurement::find_nearest(DeviceBuffer* locations, std::size_t first, std::size_t end) {
  launch(executor_, nearest_,
         arguments::find_nearest{.surface = surface_,
                                 .points = locations,
                                 .coordinates = coordinates_.get(),
                                 .first = int(first),
                                 .end = int(end)},
         end - first);
}

void PropertyMeasurement::measure_copies(const PointSet& points, std::uint32_t wanted, std::size_t first,
                                         Values<std::uint32_t>& words) {
  const std::size_t count = points.locations.size(), width = words_per_point(wanted), total = words.size() / width;
  PointBuffers buffers{copy(points.locations, points_, "points"),
                       copy(points.coordinates, coordinates_, "surface coordinates"),
                       copy(points.directions, directions_, "directions")};
  if (has_coordinates_ && points.coordinates.empty()) {
    ensure(coordinates_, count, "surface coordinates");
    find_nearest(buffers.locations, 0, count);
    buffers.coordinates = coordinates_.get();
  }
  ensure(columns_, count * width, "properties");
  launch_points(buffers, columns_.get(), 0, count, count, wanted);
  std::size_t column = 0;
  for (const std::size_t column_width : column_widths(wanted)) {
    columns_.read(std::span(words).subspan(column * total + first * column_width, count * column_width),
                  column * count);
    column += column_width;
  }
}

template <class T>
void PropertyMeasurement::ensure(TypedBuffer<T>& buffer, std::size_t count, std::string_view purpose) {
  if (!buffer || buffer.bytes() < count * sizeof(T)) buffer = TypedBuffer<T>(executor_, count, purpose);
}

template <class T>
DeviceBuffer* PropertyMeasurement::copy(std::span<const T> values, TypedBuffer<T>& buffer, std::string_view purpose) {
  if (values.empty()) return nullptr;
  ensure(buffer, values.size(), purpose);
  buffer.write(values);
  return buffer.get();
}

template <class T>
std::unique_ptr<DeviceBuffer> PropertyMeasurement::share(std::span<const T> values, std::string_view purpose) {
  return values.empty() ? nullptr : executor_.share(values.data(), values.size_bytes(), purpose);
}

}  // namespace smurf
