#include "harness/kernel_cover.hpp"
namespace smurf::test {
KERNELS(trace_curtain);
}
