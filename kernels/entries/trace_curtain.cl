// Where the nodes of a lattice come from.
#include "flow"
#include "stream/curtain.inc"

KERNEL(trace_curtain) {
  integer items = first + lane_items(work_item());
  // Items beyond the last would read what its own item writes.
  if (any_lane(items < end)) {
    Flow flow = flow_open(flow_buffers());
    trace_curtain_of(flow, curtain, table, items, end);
  }
}
