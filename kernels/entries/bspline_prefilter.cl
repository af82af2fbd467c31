// B-spline coefficients along one axis.
#include "grid/prefilter.inc"

KERNEL(bspline_prefilter) {
  bspline_prefilter_lines(coefficients, low_parts, lane_items(work_item()), size_x, size_y, size_z, axis);
}
