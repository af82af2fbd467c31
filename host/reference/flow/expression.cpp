// Expressions as fields, by expression::Evaluator.
#include "flows/expression/definition.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "expression/evaluate.hpp"
#include "flows/kinds.hpp"
#include "reference/flow/box.hpp"

namespace smurf {
namespace {

class ExpressionReference final : public BoxFlow {
 public:
  explicit ExpressionReference(const ExpressionFlow& flow)
      : BoxFlow(flow.domain), evaluator_(flow.graph(), std::span(flow.nodes()).first(3)) {}

  glm::dvec3 value(std::int32_t, const glm::dvec3& point, const glm::dvec3&) const override {
    thread_local std::vector<double> scratch;
    const std::array<double, 3> variables{point.x, point.y, point.z};
    std::array<double, 3> v{};
    evaluator_(variables, v, scratch);
    return {v[0], v[1], v[2]};
  }

 private:
  expression::Evaluator evaluator_;
};

}  // namespace

std::shared_ptr<const ReferenceFlow> refer_expression_flow(const VectorFieldDefinition& definition) {
  return std::make_shared<ExpressionReference>(dynamic_cast<const ExpressionFlow&>(definition));
}

}  // namespace smurf
