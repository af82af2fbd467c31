// Normals at the vertices of a mesh.
#include "mesh/curvature.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer places, rings, vertices, fits;
  int count, scale;
};

void main() { mesh_normals_of(places, rings, vertices, fits, lane_items(item_index()), count, as_plain_real(scale)); }
