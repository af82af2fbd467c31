// Stream surfaces, answered by the reference.
#include "reference/surface.hpp"
#include "smurf/error.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {

std::shared_ptr<const ReferenceSurface> refer_stream(const SurfaceDefinition&) {
  throw Error(ErrorCode::usage, "not there yet");
}

}  // namespace smurf
