// How many hits of each ray are flagged.
#include "batch/count_flagged.inc"

KERNEL(count_flagged) { count_flagged_of(counts, slots, flagged, lane_items(work_item()), count, capacity); }
