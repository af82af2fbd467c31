// Samples with a margin.
#include "grid/pad.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, from, to;
  int count;
};

void main() { grid_pad_samples(grid_open(uniforms, from), from, to, lane_items(item_index()), count); }
