// Vector fields given by expressions, from API calls and descriptions.
#include "flows/expression/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "expression/parser.hpp"
#include "fields/domain.hpp"
#include "flows/kinds.hpp"
#include "io/description.hpp"
#include "smurf/error.hpp"

namespace smurf {

ExpressionFlow::ExpressionFlow(const std::array<std::string, 3>& vector, const Domain& the_domain,
                               const Parameters& parameters)
    : VectorFieldDefinition(FlowKind::expression), texts(vector), domain(require_domain(the_domain)) {
  static const std::vector<std::string> variables{"x", "y", "z"};
  for (std::size_t c = 0; c < 3; c++) {
    try {
      nodes_[c] = expression::parse(graph_, vector[c], variables, parameters);
    } catch (const Error& error) {
      throw Error(error.code(), fmt::format("vector[{}]: {}", c, error.what()));
    }
  }
  constexpr std::pair<int, int> second[] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (std::size_t c = 0; c < 3; c++) {
    for (std::size_t axis = 0; axis < 3; axis++)
      nodes_[3 + 3 * axis + c] = expression::derivative(graph_, nodes_[c], int(axis));
    for (std::size_t k = 0; k < std::size(second); k++)
      nodes_[12 + 3 * k + c] =
          expression::derivative(graph_, nodes_[3 + 3 * std::size_t(second[k].first) + c], second[k].second);
  }
  if (!expression::has_creases(graph_)) bends_.emplace(graph_, std::span(nodes_).subspan(12));
}

double ExpressionFlow::greatest_speed() const { return std::numeric_limits<double>::quiet_NaN(); }

// The length of the vector of the norms (of Frobenius) of the components' second derivatives.
double ExpressionFlow::greatest_bend(const Bounds& box) const {
  if (!bends_) return std::numeric_limits<double>::infinity();
  std::array<expression::Interval, 3> at;
  for (std::size_t axis = 0; axis < 3; axis++) at[axis] = {box.lower[int(axis)], box.upper[int(axis)]};
  std::array<expression::Interval, 18> bends;
  std::vector<expression::Interval> scratch;
  (*bends_)(at, bends, scratch);
  double squares = 0;
  for (std::size_t k = 0; k < bends.size(); k++) {
    const double greatest = std::max(std::abs(bends[k].low), std::abs(bends[k].high));
    if (!bends[k].defined || !std::isfinite(greatest)) return std::numeric_limits<double>::infinity();
    squares += (k < 9 ? 1 : 2) * greatest * greatest;  // xx, yy, zz, then xy, xz, yz
  }
  return std::sqrt(squares) * (1 + 1e-12);
}

std::vector<Fact> ExpressionFlow::facts() const {
  return {{"vector", fmt::format("({}, {}, {})", expression::excerpt(texts[0]), expression::excerpt(texts[1]),
                                 expression::excerpt(texts[2]))},
          {"derivatives", "exact"}};
}

VectorField expression_flow(const std::array<std::string, 3>& vector, const Domain& domain,
                            const Parameters& parameters) {
  return VectorField(std::make_shared<const ExpressionFlow>(vector, domain, parameters));
}

std::shared_ptr<const VectorFieldDefinition> read_expression_flow(const nlohmann::json& field, std::string_view path,
                                                                  const std::filesystem::path&) {
  description::only_members(field, path, {"kind", "vector", "domain", "radius", "parameters"});
  const std::array<std::string, 3> vector = description::three_expressions(field, path, "vector", "x, y and z");
  const Domain domain = description::required_domain(field, path);
  const Parameters parameters = description::parameters(field, path);
  return description::named(path, "vector", [&] { return expression_flow(vector, domain, parameters).share(); });
}

}  // namespace smurf
