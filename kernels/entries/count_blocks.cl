// Sums per block of rays.
#include "batch/count.inc"

KERNEL(count_blocks) {
  int which = work_item();
  if (which * block < count) count_block(counts, blocks, which, count, block);
}
