// Options of stream surfaces that are there already.
#include <fmt/format.h>

#include "smurf/error.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {
namespace {

const StreamSurface& stream_of(const Surface& surface) {
  const auto* stream = dynamic_cast<const StreamSurface*>(&surface.model());
  if (stream == nullptr) {
    throw Error(ErrorCode::usage,
                fmt::format("only stream surfaces have these options, not surfaces of kind \"{}\"", surface.kind()));
  }
  return *stream;
}

}  // namespace

std::shared_ptr<const StreamSurface> StreamSurface::with(const StreamOptions& options) const {
  const auto surface = std::make_shared<StreamSurface>(field_, seed_, options);
  if (surface->options_.time == options_.time && surface->options_.tolerance == options_.tolerance)
    surface->kept_ = kept_;
  return surface;
}

const StreamOptions& options_of(const Surface& surface) { return stream_of(surface).options(); }

Surface with_options(const Surface& surface, const StreamOptions& options) {
  return Surface(stream_of(surface).with(options));
}

glm::dvec2 seed_range(const Surface& surface) { return stream_of(surface).seed().range(); }

}  // namespace smurf
