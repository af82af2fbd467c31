// Points of a walk at its start.
#include "surface"
#include "walk"
#include "walk/points.inc"

KERNEL(begin_walk) {
  Surface surface = surface_open(surface_buffers());
  walk_begin(surface, points, coordinates, directions, walked, first + lane_items(work_item()), end, stride,
             as_plain_real(tolerance));
}
