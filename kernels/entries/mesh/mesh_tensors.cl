// Shape tensors at the vertices of a mesh.
#include "mesh/curvature.inc"

KERNEL(mesh_tensors) {
  mesh_tensors_of(places, rings, fits, vertices, lane_items(work_item()), count, as_plain_real(scale));
}
