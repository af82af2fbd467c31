// Neighbours of the vertices of a mesh.
#include "mesh/rings.inc"

__kernel WORK_GROUP void mesh_rings(Buffer fans, Buffer sizes, Buffer plan, Buffer rings, int count) {
  mesh_rings_of(fans, sizes, plan, rings, lane_items(get_global_id(0)), count);
}
