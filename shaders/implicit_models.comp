// Taylor models of the cells in a list.
#include "models"

layout(local_size_x = GROUP) in;

layout(push_constant) uniform Arguments {
  Buffer uniforms, cells, tapes, list, models;
  int count, marks_only;
};

void main() {
  implicit_models_of(grid_open(uniforms, list), cells, tapes, list, models, lane_items(item_index()), count,
                     marks_only);
}
