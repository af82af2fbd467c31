// Normals at the vertices of a mesh.
#include "mesh_curvature.inc"

__kernel WORK_GROUP void mesh_normals(Buffer parameters, Buffer pairs, Buffer rings, Buffer vertices, Buffer fits, int count) {
  mesh_normals_of(parameters, pairs, rings, vertices, fits, lane_items(get_global_id(0)), count);
}
