// First or all hits of the rays of a tile.
#include "batch/find_hits.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, surface_a, surface_b, surface_c, surface_d, rays, counts, slots;
  int first, count, stride, image_width, capacity, first_only;
};

void main() {
  Surface surface = surface_open(uniforms, surface_a, surface_b, surface_c, surface_d);
  find_hits_of(surface, rays, counts, slots, lane_items(item_index()), first, count, stride, image_width, capacity,
               first_only);
}
