#include "harness/kernel_cover.hpp"
KERNELS(vector_prefilter, vector_pad);
