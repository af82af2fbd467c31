// A margin about the coefficients of vectors.
#include "flow/pad.inc"

KERNEL(vector_pad) { vector_pad_node(from, to, work_item(), size_x, size_y, size_z, periodic); }
