// Samples with a margin.
#include "grid/pad.inc"

KERNEL(grid_pad) { grid_pad_samples(grid_open(uniforms, from), from, to, lane_items(work_item()), count); }
