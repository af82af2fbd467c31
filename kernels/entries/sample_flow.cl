// Values of a vector field at points.
#include "flow"
#include "flow/sampling.inc"

KERNEL(sample_flow) {
  Flow flow = flow_open(flow_buffers());
  sample_flow_of(flow, points, columns, first + lane_items(work_item()), end, stride, order);
}
