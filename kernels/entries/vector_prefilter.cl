// B-spline coefficients of vectors along one axis.
#include "flow/prefilter.inc"

KERNEL(vector_prefilter) { vector_prefilter_item(samples, work_item(), size_x, size_y, size_z, axis, periodic); }
