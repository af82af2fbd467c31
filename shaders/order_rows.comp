// Compressed rows of a tile.
#include "batch/order.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer rays, counts, slots, block_offsets, row_rays, row_t, row_uncertainty, row_status, row_locations,
      row_coordinates, ray_offsets, ray_status;
  int first, number, count, stride, block, before_low, before_high;
};

void main() {
  int item = lane_items(item_index());
  if (item < count) {
    order_lanes(rays, counts, slots, block_offsets, row_rays, row_t, row_uncertainty, row_status, row_locations,
                row_coordinates, ray_offsets, ray_status, item, first, number, count, stride, block, before_low,
                before_high);
  }
}
