// Hits, more exactly.
#include "batch/polish_hits.inc"

KERNEL(polish_hits) {
  Surface surface = surface_open(surface_buffers());
  polish_hits_of(surface, rays, places, lane_items(work_item()), count);
}
