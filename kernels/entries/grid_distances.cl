// How far cells are from active ones.
#include "grid/distances.inc"

KERNEL(grid_distances) {
  integer items = lane_items(work_item());
  integer block = min_integer(items, splat_integer(count - 1));
  grid_block_distances(grid_open(uniforms, samples), cells, skips, distances, block, items < count);
}
