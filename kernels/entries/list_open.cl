// The rays that a search has left open.
#include "batch/count.inc"

KERNEL(list_open) {
  int which = work_item();
  if (which * block < count) list_open_rays(counts, block_offsets, list, which, count, block);
}
