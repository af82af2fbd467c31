// Walks on a surface on a device (kernels/walk/points.inc): the points of a tile stay there from step to step, and what
// each step has reached is copied to the host.
#pragma once

#include <optional>

#include "device/executor.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {

class WalkSteps {
 public:
  // Compiles nothing yet.
  WalkSteps(Executor& executor, const ResidentSurface& surface, bool coordinates);

  // As SurfaceQueries::walk. Throws Error (usage) for kinds without a device walk; `kind` is for the message.
  void walk(ResidentSurface& surface, std::string_view kind, const WalkStart& start, const WalkOptions& options,
            const WalkSink& sink);

 private:
  void begin(const WalkStart& start, std::size_t first, std::size_t count, float tolerance);

  template <class T>
  void ensure(TypedBuffer<T>& buffer, std::size_t count, std::string_view purpose);

  Executor& executor_;
  const bool walks_, has_coordinates_;
  Program begin_, walk_, nearest_;
  BufferGroup surface_;
  TypedBuffer<glm::vec3> points_, directions_;
  TypedBuffer<SurfaceCoordinates> coordinates_;
  TypedBuffer<float> distances_;
  TypedBuffer<std::uint32_t> walked_;
};

}  // namespace smurf
