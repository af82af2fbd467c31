// Shape tensors at the vertices of a mesh.
#include "mesh_curvature.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer parameters, pairs, fits, vertices;
  int count;
};

void main() {
  mesh_tensors_of(parameters, pairs, fits, vertices, lane_items(item_index()), count);
}
