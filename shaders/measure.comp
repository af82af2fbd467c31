// Properties of surface points.
#include "surface"
#include "batch/measure.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, surface_a, surface_b, surface_c, surface_d, points, coordinates, directions, columns;
  int first, end, stride, wanted;
};

void main() {
  Surface surface = surface_open(uniforms, surface_a, surface_b, surface_c, surface_d);
  measure_points(surface, points, coordinates, directions, columns, first + lane_items(item_index()), end, stride,
                 wanted);
}
