// The cells that can hold a root at this isovalue.
#include "cells"

KERNEL(grid_activate) {
  integer items = lane_items(work_item());
  integer block = min_integer(items, splat_integer(count - 1));
  Grid grid = grid_open(uniforms, samples);
  CellBits bits = grid_block_cells(grid, block, grid_block_reaches(grid, bounds, block));
  store_word(cells, 2 * block, bits.low, items < count);
  store_word(cells, 2 * block + 1, bits.high, items < count);
}
