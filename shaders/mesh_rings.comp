// Neighbours of the vertices of a mesh.
#include "mesh/rings.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer fans, sizes, plan, rings;
  int count;
};

void main() { mesh_rings_of(fans, sizes, plan, rings, lane_items(item_index()), count); }
