// Fans of triangles about the vertices of a mesh.
#include "mesh/rings.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer corners, fans, sizes;
  int count;
};

void main() { mesh_fans_of(corners, fans, sizes, lane_items(item_index()), count); }
