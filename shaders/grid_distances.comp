// How far cells are from active ones.
#include "grid/distances.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, surface_a, cells, skips, distances;
  int count;
};

void main() {
  integer items = lane_items(item_index());
  integer block = min_integer(items, splat_integer(count - 1));
  grid_block_distances(grid_open(uniforms, surface_a), cells, skips, distances, block, items < count);
}
