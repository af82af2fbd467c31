#include <gtest/gtest.h>

#include "harness/kernel_cover.hpp"

KERNELS(find_hits, count_blocks, order_rows, list_open, finish_hits);
