// Sums per block of rays.
#include "batch/count.inc"

__kernel WORK_GROUP void count_blocks(Buffer counts, Buffer blocks, int count, int block) {
  int which = (int)get_global_id(0);
  if (which * block < count) count_block(counts, blocks, which, count, block);
}
