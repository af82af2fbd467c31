#include "surfaces/stream/mesh.hpp"

#include "smurf/error.hpp"

namespace smurf {

StreamMesh make_stream_mesh(FlowQueries&, const VectorFieldDefinition&, const SeedCurve&, const StreamMeshRequest&) {
  throw Error(ErrorCode::usage, "not there yet");
}

StreamPolygons stream_polygons(const Surface&) { throw Error(ErrorCode::usage, "not there yet"); }

}  // namespace smurf
