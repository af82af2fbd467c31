// How far cells are from active ones.
#include "grid/distances.inc"

__kernel WORK_GROUP void grid_distances(Buffer uniforms, Buffer surface_a, Buffer cells, Buffer skips, Buffer distances,
                                        int count) {
  integer items = lane_items(get_global_id(0));
  integer block = min_integer(items, splat_integer(count - 1));
  grid_block_distances(grid_open(uniforms, surface_a), cells, skips, distances, block, items < count);
}
