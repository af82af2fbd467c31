// Streamlines, some steps further.
#include "flow"
#include "flow/trace.inc"

KERNEL(trace_lines) {
  Flow flow = flow_open(flow_buffers());
  trace_lines_of(flow, options, list, lines, points, counts, lane_items(work_item()), count, stride, room, turns,
                 begin);
}
