// The range of values in each block of cells.
#include "cells"

__kernel WORK_GROUP void grid_bounds(Buffer uniforms, Buffer surface_a, Buffer bounds, int count) {
  integer items = lane_items(get_global_id(0));
  integer block = min_integer(items, splat_integer(count - 1));
  Range range = grid_block_range(grid_open(uniforms, surface_a), block);
  store_real(bounds, 2 * block, range.low, items < count);
  store_real(bounds, 2 * block + 1, range.high, items < count);
}
