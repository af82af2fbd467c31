// Fans of triangles about the vertices of a mesh.
#include "mesh/rings.inc"

KERNEL(mesh_fans) { mesh_fans_of(corners, fans, sizes, lane_items(work_item()), count); }
