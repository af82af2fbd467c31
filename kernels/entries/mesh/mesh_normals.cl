// Normals at the vertices of a mesh.
#include "mesh/curvature.inc"

KERNEL(mesh_normals) {
  mesh_normals_of(places, rings, vertices, fits, lane_items(work_item()), count, as_plain_real(scale));
}
