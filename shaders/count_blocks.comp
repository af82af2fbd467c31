// Sums per block of rays.
#include "batch/count.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer counts, blocks;
  int count, block;
};

void main() {
  int which = int(item_index());
  if (which * block < count) count_block(counts, blocks, which, count, block);
}
