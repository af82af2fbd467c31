// Compressed rows of a tile.
#include "batch/order.inc"

__kernel WORK_GROUP void order_rows(Buffer rays, Buffer counts, Buffer slots, Buffer block_offsets, Buffer row_rays,
                                    Buffer row_t, Buffer row_uncertainty, Buffer row_status, Buffer row_locations,
                                    Buffer row_coordinates, Buffer ray_offsets, Buffer ray_status, int first,
                                    int number, int count, int stride, int block, int before_low, int before_high) {
  integer items = lane_items(get_global_id(0));
  if (lane_integer(items, 0) < count) {
    order_lanes(rays, counts, slots, block_offsets, row_rays, row_t, row_uncertainty, row_status, row_locations,
                row_coordinates, ray_offsets, ray_status, items, first, number, count, stride, block, before_low,
                before_high);
  }
}
