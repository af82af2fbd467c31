// B-spline coefficients along one axis.
#include "grid/prefilter.inc"

__kernel WORK_GROUP void bspline_prefilter(Buffer coefficients, Buffer low_parts, int size_x, int size_y, int size_z,
                                           int axis) {
  bspline_prefilter_lines(coefficients, low_parts, lane_items(get_global_id(0)), size_x, size_y, size_z, axis);
}
