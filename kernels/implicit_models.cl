// Taylor models of the cells in a list.
#include "models"

__kernel WORK_GROUP void implicit_models(Buffer uniforms, Buffer cells, Buffer tapes, Buffer list, Buffer models,
                                         int count, int marks_only) {
  implicit_models_of(grid_open(uniforms, list), cells, tapes, list, models, lane_items(get_global_id(0)), count,
                     marks_only);
}
