// First or all hits of the rays of a tile.
#include "batch/find_hits.inc"

KERNEL(find_hits) {
  Surface surface = surface_open(surface_buffers());
  find_hits_of(surface, rays, counts, slots, lane_items(work_item()), first, count, stride, image_width, capacity,
               wanted_hits);
}
