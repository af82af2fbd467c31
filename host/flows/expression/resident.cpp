// Vector fields given by expressions on a device: the expressions and their derivatives become device source. Device
// memory: seven words.
#include <array>
#include <cstdint>

#include "expression/source.hpp"
#include "flows/expression/definition.hpp"
#include "flows/kinds.hpp"
#include "flows/resident_flow.hpp"
#include "kernels/flow/layout.inc"

namespace smurf {
namespace {

std::string source_of(const ExpressionFlow& flow) {
  const std::span<const expression::NodeId> nodes(flow.nodes());
  const expression::Graph& graph = flow.graph();
  std::string text = "#include \"arithmetic/real_number.inc\"\n";
  text += expression::function_source(graph, nodes.first(3), "FN real3 expression_flow(real v0, real v1, real v2)", "",
                                      "  return make3({0}, {1}, {2});\n");
  const std::string slope =
      "  FlowJet jet;\n  jet.v = make3({0}, {1}, {2});\n  jet.x = make3({3}, {4}, {5});\n"
      "  jet.y = make3({6}, {7}, {8});\n  jet.z = make3({9}, {10}, {11});\n";
  text += expression::function_source(
      graph, nodes.first(12), "FN FlowJet expression_flow_slope(real v0, real v1, real v2)", "",
      slope +
          "  jet.xx = zero3();\n  jet.yy = zero3();\n  jet.zz = zero3();\n"
          "  jet.xy = zero3();\n  jet.xz = zero3();\n  jet.yz = zero3();\n  return jet;\n");
  text += expression::function_source(
      graph, nodes, "FN FlowJet expression_flow_bend(real v0, real v1, real v2)", "",
      slope +
          "  jet.xx = make3({12}, {13}, {14});\n  jet.yy = make3({15}, {16}, {17});\n"
          "  jet.zz = make3({18}, {19}, {20});\n  jet.xy = make3({21}, {22}, {23});\n"
          "  jet.xz = make3({24}, {25}, {26});\n  jet.yz = make3({27}, {28}, {29});\n  return jet;\n");
  return text;
}

class ResidentExpressionFlow final : public ResidentFlow {
 public:
  ResidentExpressionFlow(const ExpressionFlow& flow, Executor& executor)
      : uniforms_(executor, FLOW_DOMAIN_WORDS, "field uniforms") {
    modules_["flow"] = kernel_source("flow/expression.inc");
    modules_["flow_expression"] = source_of(flow);
    std::array<std::uint32_t, FLOW_DOMAIN_WORDS> words{};
    put_flow_domain(flow.domain, words);
    uniforms_.write(words);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return {{"uniforms", uniforms_.get()}}; }
  std::size_t bytes() const override { return uniforms_.bytes(); }

 private:
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_;
};

}  // namespace

std::unique_ptr<ResidentFlow> reside_expression_flow(const VectorFieldDefinition& definition, Executor& executor,
                                                     const PrepareOptions&) {
  return std::make_unique<ResidentExpressionFlow>(dynamic_cast<const ExpressionFlow&>(definition), executor);
}

}  // namespace smurf
