// B-spline coefficients of vectors along one axis.
#include "flow/prefilter.inc"

KERNEL(vector_prefilter) {
  vector_prefilter_lines(samples, lane_items(work_item()), size_x, size_y, size_z, axis, periodic);
}
