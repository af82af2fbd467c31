// Samples with a margin.
#include "grid/pad.inc"

__kernel WORK_GROUP void grid_pad(Buffer uniforms, Buffer from, Buffer to, int count) {
  grid_pad_samples(grid_open(uniforms, from), from, to, lane_items(get_global_id(0)), count);
}
