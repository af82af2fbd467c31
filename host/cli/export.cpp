// The verb `export`: a stream surface as polygons, with u and τ, normals and curvature.
#include <fmt/format.h>

#include <cstdio>

#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "smurf/error.hpp"
#include "smurf/stream_export.hpp"

namespace smurf {

void run_export(const ExportCommand& command, const CommonOptions& common) {
  check_output(command.output, {".vtp", ".ply"});
  const Surface surface = load_surface(command.surface);
  if (surface.kind() != "stream") {
    throw Error(ErrorCode::usage, fmt::format("{}: export is for stream surfaces, not for kind \"{}\"",
                                              command.surface.string(), surface.kind()));
  }
  const Device device = open(command.device, common);
  const Stopwatch watch;
  MeasuredPolygons mesh;
  {
    Progress progress("measuring corners", common.quiet);
    mesh = naming(command.surface, [&] { return measured_polygons(device, surface, progress.callback()); });
  }
  save_polygons(mesh, command.output);
  if (mesh.left_out > 0 && !common.quiet)
    fmt::print(stderr, "smurf: {} polygons are left out: streamlines end before their corners\n", mesh.left_out);
  report(device, common, "corners", mesh.polygons.places.size(), watch.seconds());
}

}  // namespace smurf
