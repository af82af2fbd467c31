// Normals at the vertices of a mesh.
#include "mesh/curvature.inc"

__kernel WORK_GROUP void mesh_normals(Buffer places, Buffer rings, Buffer vertices, Buffer fits, int count, int scale) {
  mesh_normals_of(places, rings, vertices, fits, lane_items(get_global_id(0)), count, as_plain_real(scale));
}
