// Fans of triangles about the vertices of a mesh.
#include "mesh/rings.inc"

__kernel WORK_GROUP void mesh_fans(Buffer corners, Buffer fans, Buffer sizes, int count) {
  mesh_fans_of(corners, fans, sizes, lane_items(get_global_id(0)), count);
}
