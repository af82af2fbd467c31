// First or all hits of the rays that a search has left open.
#include "batch/finish_hits.inc"

KERNEL(finish_hits) {
  int which = work_item();
  if (begin + which < end) {
    Surface surface = surface_open(surface_buffers());
    finish_hits_of(surface, rays, list, room, counts, slots, begin + which, which, first, count, stride, capacity,
                   room_words, room_hits, wanted_hits);
  }
}
