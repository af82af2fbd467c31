#include "api/walk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "kernels/layout/records.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr std::size_t points_in_tile = 1 << 18;

}  // namespace

WalkSteps::WalkSteps(Executor& executor, const ResidentSurface& surface, bool coordinates)
    : executor_(executor), walks_(surface.modules().contains("walk")), has_coordinates_(coordinates) {
  const auto program = [&](const char* begins) {
    Program p = surface.program(KernelId::walk);
    p.defines["COORDINATES"] = coordinates ? "1" : "0";
    p.defines["CURVATURE"] = "0";
    p.defines["WALK_BEGINS"] = begins;
    return p;
  };
  begin_ = program("1");
  walk_ = program("0");
  nearest_ = surface.program(KernelId::find_nearest);
  nearest_.defines["COORDINATES"] = "1";
  nearest_.defines["CURVATURE"] = "0";
}

void WalkSteps::walk(ResidentSurface& surface, std::string_view kind, const WalkStart& start,
                     const WalkOptions& options, const WalkSink& sink) {
  if (!walks_)
    throw Error(ErrorCode::usage,
                fmt::format("surfaces of kind \"{}\" cannot be walked on yet on this device; others can, among them "
                            "isosurfaces and implicit surfaces",
                            kind));
  surface.prepare_properties();
  surface.prepare_walks();
  surface_ = surface.buffers();
  const std::size_t size = start.points.locations.size();
  const std::size_t tile = std::min(options.tile != 0 ? options.tile : points_in_tile, std::max<std::size_t>(size, 1));
  ensure(walked_, tile * WALK_WORDS, "points of a walk");
  ensure(distances_, tile, "distances of a walk");
  const bool common = start.distances.size() == 1 && size != 1;
  std::size_t done = 0;
  const std::size_t total = size * std::size_t(start.steps);
  Values<std::uint32_t> words(tile * WALK_WORDS);
  for (std::size_t first = 0; first < size; first += tile) {
    const std::size_t count = std::min(tile, size - first);
    begin(start, first, count, options.tolerance);
    distances_.write(common ? start.distances : start.distances.subspan(first, count));
    for (int step = 0; step <= start.steps; step++) {
      if (step > 0)
        launch(executor_, walk_,
               arguments::walk{.surface = surface_,
                               .distances = distances_.get(),
                               .walked = walked_.get(),
                               .first = 0,
                               .end = int(count),
                               .stride = int(count),
                               .distance_step = common ? 0 : 1},
               count);
      if (step == 0 && !start.tell_start) continue;
      walked_.read(std::span(words).first(count * WALK_WORDS));
      const auto column = [&]<class T>(int at, const T*) {
        return std::span(reinterpret_cast<const T*>(words.data() + std::size_t(at) * count), count);
      };
      const glm::vec3* vector = nullptr;
      sink({.first = first,
            .step = step,
            .locations = column(WALK_LOCATION, vector),
            .normals = column(WALK_NORMAL, vector),
            .directions = column(WALK_DIRECTION, vector),
            .coordinates = column(WALK_COORDINATES, static_cast<const SurfaceCoordinates*>(nullptr)),
            .chords = column(WALK_CHORD, static_cast<const float*>(nullptr)),
            .status = column(WALK_STATUS, static_cast<const WalkStatus*>(nullptr))});
      if (step > 0) done += count;
      if (options.progress && step > 0) options.progress(done, total);
    }
  }
}

void WalkSteps::begin(const WalkStart& start, std::size_t first, std::size_t count, float tolerance) {
  ensure(points_, count, "points");
  ensure(directions_, count, "directions");
  points_.write(start.points.locations.subspan(first, count));
  directions_.write(start.points.directions.subspan(first, count));
  const bool located = !start.points.coordinates.empty();
  if (has_coordinates_) {
    ensure(coordinates_, count, "surface coordinates");
    if (located) coordinates_.write(start.points.coordinates.subspan(first, count));
  }
  if (has_coordinates_ && !located)
    launch(executor_, nearest_,
           arguments::find_nearest{.surface = surface_,
                                   .points = points_.get(),
                                   .coordinates = coordinates_.get(),
                                   .first = 0,
                                   .end = int(count)},
           count);
  launch(executor_, begin_,
         arguments::walk{.surface = surface_,
                         .points = points_.get(),
                         .coordinates = coordinates_.get(),
                         .directions = directions_.get(),
                         .walked = walked_.get(),
                         .first = 0,
                         .end = int(count),
                         .stride = int(count),
                         .tolerance = std::bit_cast<int>(tolerance)},
         count);
}

template <class T>
void WalkSteps::ensure(TypedBuffer<T>& buffer, std::size_t count, std::string_view purpose) {
  if (!buffer || buffer.bytes() < count * sizeof(T)) buffer = TypedBuffer<T>(executor_, count, purpose);
}

}  // namespace smurf
