// GLSL compute shaders to SPIR-V 1.5, by the glslang library.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace smurf::vulkan {

// What the SPIR-V asks of the device beyond Vulkan 1.2 with buffer device addresses. Both keep
// arithmetic as the source has it; a device that has neither may drop NaN, infinity and signed zeros.
struct FloatControls {
  bool preserve_signed_zero_inf_nan = false;
  bool round_to_nearest_even = false;
};

// Names everything that decides what compile_glsl makes of a source, for cache keys.
std::string compiler_identity(const FloatControls& controls);

// Every floating-point operation of the result is decorated NoContraction: like the OpenCL programs,
// shaders run with contraction off, so that IEEE devices agree and error-free transformations hold.
// Throws Error (device) with the first messages of the compiler; `name` says which kernel.
std::vector<std::uint32_t> compile_glsl(const std::string& source, std::string_view name,
                                        const FloatControls& controls);

}  // namespace smurf::vulkan
