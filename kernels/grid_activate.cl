// The cells that can hold a root at this isovalue.
#include "cells"

__kernel WORK_GROUP void grid_activate(Buffer uniforms, Buffer surface_a, Buffer bounds, Buffer cells, int count) {
  integer items = lane_items(get_global_id(0));
  integer block = min_integer(items, splat_integer(count - 1));
  Grid grid = grid_open(uniforms, surface_a);
  CellBits bits = grid_block_cells(grid, block, grid_block_reaches(grid, bounds, block));
  store_word(cells, 2 * block, bits.low, items < count);
  store_word(cells, 2 * block + 1, bits.high, items < count);
}
