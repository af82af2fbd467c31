// Stream surfaces on a device, by either method.
#pragma once

#include <memory>

#include "surfaces/resident_surface.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {

struct PrepareOptions;

std::unique_ptr<ResidentSurface> reside_stream_mesh(const StreamSurface& surface, Executor& executor,
                                                    const PrepareOptions& options);
std::unique_ptr<ResidentSurface> reside_back_stream(const StreamSurface& surface, Executor& executor,
                                                    const PrepareOptions& options);

}  // namespace smurf
