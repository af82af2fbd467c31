// Shape tensors at the vertices of a mesh.
#include "mesh/curvature.inc"

__kernel WORK_GROUP void mesh_tensors(Buffer places, Buffer rings, Buffer fits, Buffer vertices, int count, int scale) {
  mesh_tensors_of(places, rings, fits, vertices, lane_items(get_global_id(0)), count, as_plain_real(scale));
}
