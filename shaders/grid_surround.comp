// Samples with a margin.
#include "grid/pad.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer parameters, from, to;
  int count;
};

void main() {
  grid_surround_samples(grid_open(parameters, from), from, to, lane_items(item_index()), count);
}
