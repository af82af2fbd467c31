// Compressed rows of a tile.
#include "order.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer rays, counts, slots, block_offsets, row_rays, row_t, row_uncertainty, row_status, row_locations, row_coordinates,
      ray_offsets, ray_status;
  int first, number, count, stride, capacity, block, before_low, before_high;
};

void main() {
  int which = int(item_index());
  if (which * block < count) {
    order_block(rays, counts, slots, block_offsets, row_rays, row_t, row_uncertainty, row_status, row_locations, row_coordinates,
                ray_offsets, ray_status, which, first, number, count, stride, capacity, block, before_low, before_high);
  }
}
