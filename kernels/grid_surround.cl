// Samples with a margin.
#include "grid/pad.inc"

__kernel WORK_GROUP void grid_surround(Buffer parameters, Buffer from, Buffer to, int count) {
  grid_surround_samples(grid_open(parameters, from), from, to, lane_items(get_global_id(0)), count);
}
