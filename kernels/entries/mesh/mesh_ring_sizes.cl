// How many neighbours the vertices of a mesh have in two rings.
#include "mesh/rings.inc"

KERNEL(mesh_ring_sizes) { mesh_ring_sizes_of(fans, sizes, rings, lane_items(work_item()), count); }
