// Taylor models of the cells in a list.
#include "models"

KERNEL(implicit_models) {
  implicit_models_of(grid_open(uniforms, list), cells, tapes, list, models, lane_items(work_item()), count, marks_only);
}
