// Properties of surface points.
#include "surface"
#include "batch/measure.inc"

__kernel WORK_GROUP void measure(Buffer uniforms, Buffer surface_a, Buffer surface_b, Buffer surface_c,
                                 Buffer surface_d, Buffer points, Buffer coordinates, Buffer directions, Buffer columns,
                                 int first, int end, int stride, int wanted) {
  Surface surface = surface_open(uniforms, surface_a, surface_b, surface_c, surface_d);
  measure_points(surface, points, coordinates, directions, columns, first + lane_items(get_global_id(0)), end, stride,
                 wanted);
}
