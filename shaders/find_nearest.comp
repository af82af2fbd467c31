// The points of a surface that are nearest to points.
#include "surface"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, surface_a, surface_b, surface_c, surface_d, points, coordinates;
  int first, end;
};

void main() {
  Surface surface = surface_open(uniforms, surface_a, surface_b, surface_c, surface_d);
  surface_nearest_to(surface, points, coordinates, first + lane_items(item_index()), end);
}
