// Shape tensors at the vertices of a mesh.
#include "mesh_curvature.inc"

__kernel WORK_GROUP void mesh_tensors(Buffer parameters, Buffer pairs, Buffer fits, Buffer vertices, int count) {
  mesh_tensors_of(parameters, pairs, fits, vertices, lane_items(get_global_id(0)), count);
}
