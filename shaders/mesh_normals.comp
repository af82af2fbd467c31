// Normals at the vertices of a mesh.
#include "mesh_curvature.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer parameters, pairs, rings, vertices, fits;
  int count;
};

void main() {
  mesh_normals_of(parameters, pairs, rings, vertices, fits, lane_items(item_index()), count);
}
