// Taylor models of the cells in a list.
#include "implicit_cells.inc"

__kernel WORK_GROUP void implicit_models(Buffer parameters, Buffer list, Buffer models, int count, int marks_only) {
  implicit_models_of(grid_open(parameters, list), list, models, lane_items(get_global_id(0)), count, marks_only);
}
