#include "surfaces/stream/resident.hpp"

#include "smurf/error.hpp"
#include "surfaces/kinds.hpp"

namespace smurf {

std::unique_ptr<ResidentSurface> reside_stream(const SurfaceDefinition& definition, Executor& executor,
                                               const PrepareOptions& options) {
  const auto& surface = dynamic_cast<const StreamSurface&>(definition);
  return surface.options().method == StreamMethod::back_stream ? reside_back_stream(surface, executor, options)
                                                               : reside_stream_mesh(surface, executor, options);
}

}  // namespace smurf
