// How many neighbours the vertices of a mesh have in two rings.
#include "mesh/rings.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer fans, sizes, rings;
  int count;
};

void main() { mesh_ring_sizes_of(fans, sizes, rings, lane_items(item_index()), count); }
