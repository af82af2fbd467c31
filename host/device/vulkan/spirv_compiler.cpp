// GLSL to SPIR-V, and the few changes to the SPIR-V that GLSL has no words for.
//
// glslang leaves contraction to the driver except where the source says `precise`, and cannot ask for
// float controls. Both are added to the binary: a module is a header of five words and then
// instructions, each of which starts with (words << 16 | opcode), in an order of sections that the
// specification fixes (SPIR-V 1.5, section 2.4).
#include "device/vulkan/spirv_compiler.hpp"

#include <fmt/format.h>
#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <glslang/SPIRV/spirv.hpp>

#include <algorithm>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>

#include "smurf/error.hpp"

namespace smurf::vulkan {
namespace {

constexpr std::size_t header_words = 5;
constexpr std::size_t bound_word = 3;  // in the header: all ids are below
constexpr std::size_t log_lines = 6;
// Raised whenever the changes made below to the SPIR-V change, so that caches notice.
constexpr int revision = 1;

std::uint32_t opcode_of(std::uint32_t word) { return word & 0xffffu; }

std::uint32_t first_word(spv::Op op, std::uint32_t words) { return words << 16 | std::uint32_t(op); }

bool is_float_arithmetic(std::uint32_t opcode) {
  switch (opcode) {
    case spv::OpFNegate:
    case spv::OpFAdd:
    case spv::OpFSub:
    case spv::OpFMul:
    case spv::OpFDiv:
    case spv::OpFRem:
    case spv::OpFMod:
    case spv::OpVectorTimesScalar:
    case spv::OpMatrixTimesScalar:
    case spv::OpVectorTimesMatrix:
    case spv::OpMatrixTimesVector:
    case spv::OpMatrixTimesMatrix:
    case spv::OpOuterProduct:
    case spv::OpDot:
      return true;
    default:
      return false;
  }
}

std::vector<std::uint32_t> with_float_rules(const std::vector<std::uint32_t>& module, const FloatControls& controls) {
  std::vector<std::uint32_t> operations;
  std::set<std::uint32_t> decorated;
  std::size_t capabilities_end = header_words, modes_end = header_words, annotations_end = 0;
  std::uint32_t entry_point = 0;
  for (std::size_t at = header_words; at < module.size(); at += module[at] >> 16) {
    const std::uint32_t opcode = opcode_of(module[at]);
    const std::size_t next = at + (module[at] >> 16);
    if (opcode == spv::OpCapability) capabilities_end = next;
    if (opcode == spv::OpEntryPoint) entry_point = module[at + 2];
    if (opcode == spv::OpEntryPoint || opcode == spv::OpExecutionMode) modes_end = next;
    if (opcode == spv::OpDecorate && module[at + 2] == spv::DecorationNoContraction) decorated.insert(module[at + 1]);
    // Types follow the annotations.
    if (annotations_end == 0 && opcode >= spv::OpTypeVoid && opcode <= spv::OpTypeForwardPointer) annotations_end = at;
    if (is_float_arithmetic(opcode)) operations.push_back(module[at + 2]);
  }

  const auto section = [&module](std::size_t from, std::size_t to) {
    return std::vector<std::uint32_t>(module.begin() + std::ptrdiff_t(from), module.begin() + std::ptrdiff_t(to));
  };
  const auto append = [](std::vector<std::uint32_t>& to, const std::vector<std::uint32_t>& words) {
    to.insert(to.end(), words.begin(), words.end());
  };
  std::vector<std::uint32_t> result = section(0, capabilities_end);
  if (controls.preserve_signed_zero_inf_nan) {
    append(result, {first_word(spv::OpCapability, 2), spv::CapabilitySignedZeroInfNanPreserve});
  }
  if (controls.round_to_nearest_even)
    append(result, {first_word(spv::OpCapability, 2), spv::CapabilityRoundingModeRTE});
  append(result, section(capabilities_end, modes_end));
  if (controls.preserve_signed_zero_inf_nan) {
    append(result, {first_word(spv::OpExecutionMode, 4), entry_point, spv::ExecutionModeSignedZeroInfNanPreserve, 32});
  }
  if (controls.round_to_nearest_even) {
    append(result, {first_word(spv::OpExecutionMode, 4), entry_point, spv::ExecutionModeRoundingModeRTE, 32});
  }
  append(result, section(modes_end, annotations_end));
  for (const std::uint32_t id : operations) {
    if (decorated.insert(id).second) append(result, {first_word(spv::OpDecorate, 3), id, spv::DecorationNoContraction});
  }
  append(result, section(annotations_end, module.size()));
  return result;
}

// The lines of a log that say something, on one line.
std::string first_messages(const char* log) {
  std::istringstream lines(log ? log : "");
  std::string line, text;
  std::size_t count = 0;
  while (std::getline(lines, line)) {
    if (line.empty() || line.find("compilation terminated") != std::string::npos) continue;
    if (++count > log_lines) return text + " | …";
    text += (text.empty() ? "" : " | ") + line;
  }
  return text;
}

[[noreturn]] void refuse(std::string_view name, const char* log) {
  throw Error(ErrorCode::device,
              fmt::format("vulkan: the shader of kernel {} does not compile (SMURF_DUMP=folder writes its source): {}",
                          name, first_messages(log)));
}

}  // namespace

std::string compiler_identity(const FloatControls& controls) {
  const glslang::Version version = glslang::GetVersion();
  return fmt::format("glslang {}.{}.{} spirv 1.5 nan {} rte {} revision {}", version.major, version.minor,
                     version.patch, controls.preserve_signed_zero_inf_nan, controls.round_to_nearest_even, revision);
}

std::vector<std::uint32_t> compile_glsl(const std::string& source, std::string_view name,
                                        const FloatControls& controls) {
  static std::once_flag initialized;
  // Never finalized: other users of glslang in this process would lose it.
  std::call_once(initialized, [] { glslang::InitializeProcess(); });

  const char* text = source.c_str();
  glslang::TShader shader(EShLangCompute);
  shader.setStrings(&text, 1);
  shader.setEnvInput(glslang::EShSourceGlsl, EShLangCompute, glslang::EShClientVulkan, 100);
  shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_2);
  shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_5);
  const auto rules = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
  constexpr int version = 450;  // for sources without #version
  if (!shader.parse(GetDefaultResources(), version, false, rules)) refuse(name, shader.getInfoLog());
  glslang::TProgram program;
  program.addShader(&shader);
  if (!program.link(rules)) refuse(name, program.getInfoLog());

  std::vector<std::uint32_t> module;
  spv::SpvBuildLogger logger;
  glslang::SpvOptions options;
  glslang::GlslangToSpv(*program.getIntermediate(EShLangCompute), module, &logger, &options);
  if (module.size() <= header_words || module[bound_word] == 0) refuse(name, logger.getAllMessages().c_str());
  return with_float_rules(module, controls);
}

}  // namespace smurf::vulkan
