// Shape tensors at the vertices of a mesh.
#include "mesh/curvature.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer places, rings, fits, vertices;
  int count, scale;
};

void main() { mesh_tensors_of(places, rings, fits, vertices, lane_items(item_index()), count, as_plain_real(scale)); }
