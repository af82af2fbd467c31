// Properties of surface points.
#include "surface"
#include "batch/measure.inc"

KERNEL(measure) {
  Surface surface = surface_open(surface_buffers());
  measure_points(surface, points, coordinates, directions, columns, first + lane_items(work_item()), end, stride,
                 wanted);
}
