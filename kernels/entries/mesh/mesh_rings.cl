// Neighbours of the vertices of a mesh.
#include "mesh/rings.inc"

KERNEL(mesh_rings) { mesh_rings_of(fans, sizes, plan, rings, lane_items(work_item()), count); }
