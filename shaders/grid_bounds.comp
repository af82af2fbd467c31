// The range of values in each block of cells.
#include "cells"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, surface_a, bounds;
  int count;
};

void main() {
  integer items = lane_items(item_index());
  integer block = min_integer(items, splat_integer(count - 1));
  Range range = grid_block_range(grid_open(uniforms, surface_a), block);
  store_real(bounds, 2 * block, range.low, items < count);
  store_real(bounds, 2 * block + 1, range.high, items < count);
}
