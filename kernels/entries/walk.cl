// Points of a walk at its start (WALK_BEGINS 1), or a step further.
#include "surface"
#include "walk"
#include "walk/points.inc"

KERNEL(walk) {
  Surface surface = surface_open(surface_buffers());
  integer items = first + lane_items(work_item());
  if (WALK_BEGINS == 1) {
    walk_begin(surface, points, coordinates, directions, walked, items, end, stride, as_plain_real(tolerance));
  } else {
    walk_on(surface, distances, walked, items, end, stride, distance_step);
  }
}
