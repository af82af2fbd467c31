// Points of a walk, a step further.
#include "surface"
#include "walk"
#include "walk/points.inc"

KERNEL(walk) {
  Surface surface = surface_open(surface_buffers());
  walk_on(surface, distances, walked, first + lane_items(work_item()), end, stride, distance_step);
}
