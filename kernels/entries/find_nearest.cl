// The points of a surface that are nearest to points.
#include "surface"

KERNEL(find_nearest) {
  Surface surface = surface_open(surface_buffers());
  surface_nearest_to(surface, points, coordinates, first + lane_items(work_item()), end);
}
