// Vector fields by a user's own device source, from API calls and descriptions.
#include "flows/source/definition.hpp"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "expression/evaluate.hpp"
#include "fields/domain.hpp"
#include "fields/user_source.hpp"
#include "flows/expression/definition.hpp"
#include "flows/kinds.hpp"
#include "io/description.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf {

SourceFlow::SourceFlow(FlowSource the_source, const Domain& the_domain)
    : VectorFieldDefinition(FlowKind::source), function(std::move(the_source)), domain(require_domain(the_domain)) {
  require_user_source(function.source, fmt::format("the source of the field \"{}\"", function.name), "flow_source",
                      "FN real3 flow_source(real x, real y, real z)");
}

double SourceFlow::greatest_speed() const { return std::numeric_limits<double>::quiet_NaN(); }

std::vector<Fact> SourceFlow::facts() const {
  return {{"source", fmt::format("{}, {} bytes", function.name, function.source.size())},
          {"reference", function.value ? "given" : "none: only devices can answer"},
          {"derivatives", "central differences of fourth order"}};
}

VectorField source_flow(const FlowSource& source, const Domain& domain) {
  return VectorField(std::make_shared<const SourceFlow>(source, domain));
}

// "source" is a file of device code; "vector", if there is one, is the same field for the reference.
std::shared_ptr<const VectorFieldDefinition> read_source_flow(const nlohmann::json& field, std::string_view path,
                                                              const std::filesystem::path& folder) {
  description::only_members(field, path, {"kind", "source", "vector", "domain", "radius", "parameters"});
  FlowSource function;
  function.name = description::text_member(field, path, "source");
  function.source = description::named(path, "source", [&] { return read_file(folder / function.name); });
  const Domain domain = description::required_domain(field, path);
  if (field.contains("vector")) {
    nlohmann::json same = field;
    same["kind"] = "expression";
    same.erase("source");
    const auto flow =
        std::dynamic_pointer_cast<const ExpressionFlow>(read_expression_flow(same, path, std::filesystem::path()));
    const auto evaluator =
        std::make_shared<const expression::Evaluator>(flow->graph(), std::span(flow->nodes()).first(3));
    function.value = [evaluator](const glm::dvec3& p) {
      thread_local std::vector<double> scratch;
      glm::dvec3 v;
      (*evaluator)(std::array<double, 3>{p.x, p.y, p.z}, std::span<double>(&v.x, 3), scratch);
      return v;
    };
  } else if (field.contains("parameters")) {
    throw Error(ErrorCode::input, fmt::format("member \"{}\" belongs to a \"vector\", which is missing",
                                              description::join(path, "parameters")));
  }
  return source_flow(function, domain).share();
}

}  // namespace smurf
