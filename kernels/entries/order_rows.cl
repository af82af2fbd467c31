// Compressed rows of a tile.
#include "batch/order.inc"

KERNEL(order_rows) {
  integer items = lane_items(work_item());
  if (lane_integer(items, 0) < count) {
    order_lanes(rays, counts, slots, block_offsets, row_buffers(), ray_offsets, ray_status, items, first, number, count,
                stride, block, before_low, before_high);
  }
}
