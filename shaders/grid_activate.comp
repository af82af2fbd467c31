// The cells that can hold a root at this isovalue.
#include "cells"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, surface_a, bounds, cells;
  int count;
};

void main() {
  integer items = lane_items(item_index());
  integer block = min_integer(items, splat_integer(count - 1));
  Grid grid = grid_open(uniforms, surface_a);
  CellBits bits = grid_block_cells(grid, block, grid_block_reaches(grid, bounds, block));
  store_word(cells, 2 * block, bits.low, items < count);
  store_word(cells, 2 * block + 1, bits.high, items < count);
}
