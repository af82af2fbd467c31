// B-spline coefficients along one axis.
#include "grid/prefilter.inc"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer coefficients, low_parts;
  int size_x, size_y, size_z, axis;
};

void main() {
  bspline_prefilter_lines(coefficients, low_parts, lane_items(item_index()), size_x, size_y, size_z, axis);
}
