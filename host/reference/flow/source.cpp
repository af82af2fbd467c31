// Fields of a user's own device source: the reference asks the function that the user gave for the host.
#include "flows/source/definition.hpp"

#include "flows/kinds.hpp"
#include "reference/flow/box.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

class SourceReference final : public BoxFlow {
 public:
  explicit SourceReference(const SourceFlow& flow) : BoxFlow(flow.domain), value_(flow.function.value) {}

  glm::dvec3 value(std::int32_t, const glm::dvec3& point, const glm::dvec3&) const override { return value_(point); }

 private:
  std::function<glm::dvec3(const glm::dvec3&)> value_;
};

}  // namespace

std::shared_ptr<const ReferenceFlow> refer_source_flow(const VectorFieldDefinition& definition) {
  const auto& flow = dynamic_cast<const SourceFlow&>(definition);
  if (!flow.function.value)
    throw Error(ErrorCode::usage, "the vector field \"" + flow.function.name +
                                      "\" has no function for the host, which the reference asks: give one in C++ "
                                      "(FlowSource::value); devices answer without it");
  return std::make_shared<SourceReference>(flow);
}

}  // namespace smurf
