// Streamlines, some steps further.
#include "flow"
#include "flow/trace.inc"

KERNEL(trace_lines) {
  integer items = lane_items(work_item());
  // Items beyond the list stay away from the last line, which its own item is writing.
  if (any_lane(items < count)) {
    Flow flow = flow_open(flow_buffers());
    trace_lines_of(flow, options, list, lines, points, counts, items, count, stride, room, turns, begin);
  }
}
