// How many neighbours the vertices of a mesh have in two rings.
#include "mesh/rings.inc"

__kernel WORK_GROUP void mesh_ring_sizes(Buffer fans, Buffer sizes, Buffer rings, int count) {
  mesh_ring_sizes_of(fans, sizes, rings, lane_items(get_global_id(0)), count);
}
