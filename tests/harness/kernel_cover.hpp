// KERNELS(find_hits, measure) in a case file says which kernels the case exercises. CMake reads these lines and fails
// to configure while a kernel of kernels/kernels.def is named by no case; the compiler refuses names that are none.
#pragma once

#include <array>

#include "device/program.hpp"

#define KERNELS(...)                                                \
  [[maybe_unused]] static const auto covered_kernels_of_case = [] { \
    using enum ::smurf::KernelId;                                   \
    return std::array{__VA_ARGS__};                                 \
  }()
