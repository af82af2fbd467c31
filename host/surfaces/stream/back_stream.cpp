#include "smurf/error.hpp"
#include "surfaces/stream/resident.hpp"

namespace smurf {

std::unique_ptr<ResidentSurface> reside_back_stream(const StreamSurface&, Executor&, const PrepareOptions&) {
  throw Error(ErrorCode::usage, "not there yet");
}

}  // namespace smurf
