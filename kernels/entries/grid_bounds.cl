// The range of values in each block of cells.
#include "cells"

KERNEL(grid_bounds) {
  integer items = lane_items(work_item());
  integer block = min_integer(items, splat_integer(count - 1));
  Range range = grid_block_range(grid_open(uniforms, samples), block);
  store_real(bounds, 2 * block, range.low, items < count);
  store_real(bounds, 2 * block + 1, range.high, items < count);
}
