// The points of a surface that are nearest to points.
#include "surface"

__kernel WORK_GROUP void find_nearest(Buffer uniforms, Buffer surface_a, Buffer surface_b, Buffer surface_c,
                                      Buffer surface_d, Buffer points, Buffer coordinates, int first, int end) {
  Surface surface = surface_open(uniforms, surface_a, surface_b, surface_c, surface_d);
  surface_nearest_to(surface, points, coordinates, first + lane_items(get_global_id(0)), end);
}
