// Vector fields by a user's own device source on a device. Device memory: ten words.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "flows/kinds.hpp"
#include "flows/resident_flow.hpp"
#include "flows/source/definition.hpp"
#include "kernels/flow/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr int first_line_behind = 1000001;  // lines of the assembled program that follow the user's

// Steps of differences of fourth order, where truncation and the rounding of floats balance: d·ε^(1/(4 + derivative)),
// d an eighth of the domain's diagonal.
double difference_step(const Domain& domain, int derivative) {
  return glm::length(domain.upper - domain.lower) / 8 * std::exp2(-24.0 / (4 + derivative));
}

std::array<std::uint32_t, FLOW_SOURCE_WORDS> uniform_words(const Domain& domain) {
  std::array<std::uint32_t, FLOW_SOURCE_WORDS> words{};
  put_flow_domain(domain, words);
  const glm::dvec3 most = glm::max(glm::abs(domain.lower), glm::abs(domain.upper));
  const double reach = std::max({most.x, most.y, most.z}) + 3 * difference_step(domain, 2);
  // A power of two, of which 1.5·2^23 plus or minus any coordinate of a stencil is rounded to it.
  const double grid = std::ldexp(1.0, std::ilogb(reach) - 21);
  const auto put = [&](int at, double value) { words[std::size_t(at)] = std::bit_cast<std::uint32_t>(float(value)); };
  const auto on_grid = [&](double step) { return std::max(1.0, std::round(step / grid)) * grid; };
  put(FLOW_SOURCE_SNAP, 1.5 * std::ldexp(grid, 23));
  put(FLOW_SOURCE_FIRST, on_grid(difference_step(domain, 1)));
  put(FLOW_SOURCE_SECOND, on_grid(difference_step(domain, 2)));
  return words;
}

class ResidentSourceFlow final : public ResidentFlow {
 public:
  ResidentSourceFlow(const SourceFlow& flow, Executor& executor)
      : uniforms_(executor, FLOW_SOURCE_WORDS, "field uniforms") {
    modules_["flow"] = kernel_source("flow/source.inc");
    modules_["flow_source"] = fmt::format("#line 1\n{}\n#line {}\n", flow.function.source, first_line_behind);
    compile(flow.function.name, executor);
    uniforms_.write(uniform_words(flow.domain));
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return {{"uniforms", uniforms_.get()}}; }
  std::size_t bytes() const override { return uniforms_.bytes(); }

 private:
  // The first kernel that the user's source is part of: what the compiler says is said of the source.
  void compile(const std::string& name, Executor& executor) const {
    try {
      executor.prepare(program(KernelId::sample_flow));
    } catch (const Error& error) {
      if (error.code() != ErrorCode::device) throw;
      throw Error(ErrorCode::input,
                  fmt::format("the source of the field \"{}\" does not compile (lines are counted in it; those from {} "
                              "on follow it, and find fault with what it leaves open or does not define): {}",
                              name, first_line_behind, error.what()));
    }
  }

  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_;
};

}  // namespace

std::unique_ptr<ResidentFlow> reside_source_flow(const VectorFieldDefinition& definition, Executor& executor,
                                                 const PrepareOptions&) {
  return std::make_unique<ResidentSourceFlow>(dynamic_cast<const SourceFlow&>(definition), executor);
}

}  // namespace smurf
