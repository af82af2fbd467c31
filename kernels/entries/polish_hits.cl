// The hits of a tile's rays, more exactly.
#include "batch/polish_hits.inc"

KERNEL(polish_hits) {
  Surface surface = surface_open(surface_buffers());
  polish_hits_of(surface, rays, counts, slots, lane_items(work_item()), first, count, stride, capacity);
}
