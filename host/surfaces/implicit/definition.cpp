#include "surfaces/implicit/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "expression/evaluate.hpp"
#include "smurf/error.hpp"

namespace smurf {

using expression::Graph;
using expression::NodeId;

std::shared_ptr<const ImplicitFunction> differentiated(Graph graph, NodeId value) {
  ImplicitFunction function;
  function.value = value;
  for (int axis = 0; axis < 3; axis++)
    function.gradient[std::size_t(axis)] = expression::derivative(graph, value, axis);
  constexpr std::array<std::array<int, 2>, 6> pairs = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (std::size_t i = 0; i < pairs.size(); i++)
    function.hessian[i] = expression::derivative(graph, function.gradient[std::size_t(pairs[i][0])], pairs[i][1]);
  function.degree = expression::polynomial_degree(graph, value);
  function.graph = std::move(graph);
  return std::make_shared<const ImplicitFunction>(std::move(function));
}

ImplicitSurface::ImplicitSurface(std::string kind, std::string the_text,
                                 std::shared_ptr<const ImplicitFunction> the_function, double the_level, Side the_side,
                                 const Domain& the_domain)
    : SurfaceDefinition(SurfaceKind::implicit),
      text(std::move(the_text)),
      function(std::move(the_function)),
      level(the_level),
      side(the_side),
      domain(require_domain(the_domain)),
      kind_(std::move(kind)) {
  if (!std::isfinite(level)) throw Error(ErrorCode::input, fmt::format("the isovalue must be finite, not {}", level));
}

std::uint32_t ImplicitSurface::properties() const {
  return Property::value | Property::normal | Property::gauss | Property::mean | Property::principal |
         Property::directions | Property::normal_curvature | Property::distance | Property::inside;
}

std::vector<Fact> ImplicitSurface::facts() const {
  std::vector<NodeId> roots{function->value};
  std::vector<Fact> facts{{"field", "expression"},
                          {"expression", text.size() <= 200 ? text : text.substr(0, 200) + "..."},
                          {"operations", fmt::format("{}", expression::reachable(function->graph, roots).size())}};
  if (function->degree >= 0) facts.push_back({"degree", fmt::format("{}", function->degree)});
  if (kind_ == "isosurface") facts.push_back({"isovalue", fmt::format("{}", level)});
  if (domain.radius > 0) facts.push_back({"ball", fmt::format("within {:g} of the origin", domain.radius)});
  return facts;
}

std::optional<AnalyticField> ImplicitSurface::analytic_field() const {
  const std::array<NodeId, 1> roots{function->value};
  const double sign = side == Side::out_of_greater ? 1 : -1;
  auto value = [evaluator = expression::Evaluator(function->graph, roots), sign](const glm::dvec3& point) {
    thread_local std::vector<double> scratch;
    double result = 0;
    evaluator(std::span(&point.x, 3), std::span(&result, 1), scratch);
    return sign * result;
  };
  return AnalyticField{std::move(value), sign * level, domain};
}

namespace {

// Cuts [low, high] of a ray to the domain, and leaves a little of what floats round off.
void cut_to_domain(const Domain& domain, const glm::dvec3& origin, const glm::dvec3& direction, double& low,
                   double& high) {
  double enter = low, leave = high;
  for (int axis = 0; axis < 3; axis++) {
    if (direction[axis] == 0) continue;
    const double a = (domain.lower[axis] - origin[axis]) / direction[axis];
    const double b = (domain.upper[axis] - origin[axis]) / direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (domain.radius > 0) {
    const double size = glm::dot(direction, direction), middle = -glm::dot(origin, direction) / size;
    const glm::dvec3 nearest = origin + middle * direction;
    const double reach = std::sqrt(std::max(domain.radius * domain.radius - glm::dot(nearest, nearest), 0.0) / size);
    enter = std::max(enter, middle - reach);
    leave = std::min(leave, middle + reach);
  }
  constexpr double rounding = 0x1p-22;
  const double slack = rounding * std::max(std::abs(enter), std::abs(leave));
  low = std::max(low, enter - slack);
  high = std::min(high, leave + slack);
}

}  // namespace

RootResolver ImplicitSurface::root_resolver() const {
  return [roots = expression::LineRoots(function->graph, function->value, level), where = domain](
             const Ray& ray, double low, double high, std::vector<ResolvedRoot>& resolved) {
    const glm::dvec3 origin(ray.origin), direction(ray.direction);
    cut_to_domain(where, origin, direction, low, high);
    std::vector<expression::LineRoot> found;
    roots.find(origin, direction, low, high, found);
    for (const expression::LineRoot& root : found) resolved.push_back({root});
  };
}

}  // namespace smurf
