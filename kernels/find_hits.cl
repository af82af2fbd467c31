// First or all hits of the rays of a tile.
#include "batch/find_hits.inc"

__kernel WORK_GROUP void find_hits(Buffer uniforms, Buffer surface_a, Buffer surface_b, Buffer surface_c,
                                   Buffer surface_d, Buffer rays, Buffer counts, Buffer slots, int first, int count,
                                   int stride, int image_width, int capacity, int first_only) {
  Surface surface = surface_open(uniforms, surface_a, surface_b, surface_c, surface_d);
  find_hits_of(surface, rays, counts, slots, lane_items(get_global_id(0)), first, count, stride, image_width, capacity,
               first_only);
}
