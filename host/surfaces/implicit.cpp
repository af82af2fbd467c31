// Surfaces given by expressions on a device: the expression and its derivatives become device source, in four arithmetics (kernels/core):
// intervals with their slope along a ray, intervals, floats with their slope along a ray, and floats.
#include "surfaces/implicit.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "expression/evaluate.hpp"
#include "expression/polynomial_source.hpp"
#include "expression/source.hpp"
#include "implicit_parameters.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using expression::Graph;
using expression::NodeId;

// A function of the generated source: statements, and what is made of the values of its roots ({0}, {1}, ...).
std::string function_source(const Graph& graph, std::span<const NodeId> roots, std::string_view head,
                            std::string_view before, std::string_view after) {
  std::vector<std::string> names;
  std::string text = fmt::format("FN {} {{\n{}", head, before);
  text += expression::device_source(graph, roots, "", names);
  fmt::dynamic_format_arg_store<fmt::format_context> arguments;
  for (const std::string& name : names) arguments.push_back(name);
  return text + fmt::vformat(after, arguments) + "}\n";
}

// Polynomials of this degree at most are restricted to rays as such. Of higher ones the values far from the surface are so large that their
// rounding hides it; interval arithmetic narrows down to where they are small.
constexpr int greatest_degree = 6;
constexpr std::size_t most_operations = 200;

// Compilers take minutes over straight code that is longer.
constexpr std::size_t compiled_operations = 400;

bool is_handled_as_polynomial(const ImplicitFunction& function) {
  const std::vector<NodeId> value{function.value};
  return function.degree >= 1 && function.degree <= greatest_degree &&
         expression::reachable(function.graph, value).size() <= most_operations;
}

// What is asked of the expression along rays (kernels/core/piece_*.inc) and at points (implicit.inc).
std::string expression_source(const ImplicitFunction& function, bool polynomial) {
  const Graph& graph = function.graph;
  const std::vector<NodeId> value{function.value};
  std::vector<NodeId> jet{function.value};
  jet.insert(jet.end(), function.gradient.begin(), function.gradient.end());
  jet.insert(jet.end(), function.hessian.begin(), function.hessian.end());
  std::string text;
  if (polynomial) {
    text +=
        "FN Piece expression_piece(real from_x, real to_x, real error_x, real from_y, real to_y, real error_y,\n"
        "                          real from_z, real to_z, real error_z, real level) {\n  Piece piece;\n";
    text += expression::polynomial_source(graph, function.value, function.degree) + "  return piece;\n}\n";
  } else {
    text += "#include \"dual_vocabulary.inc\"\n#include \"dual_nowhere.inc\"\n";
    text += function_source(graph, value, "Span expression_span(Dual v0, Dual v1, Dual v2)",
                            "  mask nowhere = mask_none();\n",
                            "  Span span;\n  span.field = {0};\n  span.nowhere = nowhere;\n  return span;\n");
  }
  text += "#include \"interval_vocabulary.inc\"\nSTRUCT(Interval3) { Interval x, y, z; };\n";
  text +=
      function_source(graph, function.gradient, "Interval3 expression_gradient(Interval v0, Interval v1, Interval v2)",
                      "", "  Interval3 g;\n  g.x = {0};\n  g.y = {1};\n  g.z = {2};\n  return g;\n");
  if (!polynomial) {
    text += function_source(graph, value, "Interval expression_point(Interval v0, Interval v1, Interval v2)", "",
                            "  return {0};\n");
    text += "#include \"real_dual_vocabulary.inc\"\n";
    text += function_source(graph, value, "RealDual expression_along(RealDual v0, RealDual v1, RealDual v2)", "",
                            "  return {0};\n");
  }
  text +=
      "#include \"frame.inc\"\n#include \"real_vocabulary.inc\"\n"
      "STRUCT(Jet) { real value; real3 gradient; Symmetric3 hessian; };\n";
  text += function_source(graph, jet, "Jet expression_jet(real v0, real v1, real v2)", "",
                          "  Jet jet;\n  jet.value = {0};\n  jet.gradient = make3({1}, {2}, {3});\n"
                          "  jet.hessian.xx = {4};\n  jet.hessian.yy = {5};\n  jet.hessian.zz = {6};\n"
                          "  jet.hessian.xy = {7};\n  jet.hessian.xz = {8};\n  jet.hessian.yz = {9};\n  return jet;\n");
  return text;
}

class ResidentImplicit final : public ResidentSurface {
 public:
  ResidentImplicit(const ImplicitSurface& surface, Executor& executor) : function_(surface.function) {
    modules_["surface"] = embedded_core("implicit.inc");
    const std::vector<NodeId> value{function_->value};
    const std::size_t operations = expression::reachable(function_->graph, value).size();
    if (operations > compiled_operations) {
      throw Error(ErrorCode::input,
                  fmt::format("an expression of {} operations; a device compiles at most {} (the reference "
                              "takes any number)",
                              operations, compiled_operations));
    }
    const bool polynomial = is_handled_as_polynomial(*function_);
    modules_["expression"] = expression_source(*function_, polynomial);
    modules_["piece"] = embedded_core(polynomial ? "piece_polynomial.inc" : "piece_dual.inc");
    if (polynomial) defines_["DEGREE"] = fmt::format("{}", function_->degree);
    parameters_ = TypedBuffer<float>(executor, IMPLICIT_PARAMETER_WORDS, "surface parameters");
    write_parameters(surface);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  DeviceBuffer* parameters() const override { return parameters_.get(); }
  std::vector<DeviceBuffer*> buffers() const override { return {}; }
  std::size_t bytes() const override { return parameters_.bytes(); }

  bool update(const SurfaceModel& model) override {
    const auto* other = dynamic_cast<const ImplicitSurface*>(&model);
    if (!other || other->function != function_) return false;
    write_parameters(*other);
    return true;
  }

 private:
  void write_parameters(const ImplicitSurface& surface) {
    std::vector<float> words(IMPLICIT_PARAMETER_WORDS);
    for (int axis = 0; axis < 3; axis++) {
      words[std::size_t(IMPLICIT_LOWER + axis)] = float(surface.domain.lower[axis]);
      words[std::size_t(IMPLICIT_UPPER + axis)] = float(surface.domain.upper[axis]);
    }
    words[IMPLICIT_RADIUS] = float(surface.domain.radius);
    words[IMPLICIT_LEVEL] = float(surface.level);
    words[IMPLICIT_SIDE] = float(int(surface.side));
    parameters_.write(words);
  }

  std::shared_ptr<const ImplicitFunction> function_;
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<float> parameters_;
};

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

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
                                 const ImplicitDomain& the_domain)
    : text(std::move(the_text)),
      function(std::move(the_function)),
      level(the_level),
      side(the_side),
      domain(the_domain),
      kind_(std::move(kind)) {
  if (!std::isfinite(level)) throw Error(ErrorCode::input, fmt::format("the isovalue must be finite, not {}", level));
  const glm::dvec3 &lower = domain.lower, &upper = domain.upper;
  if (!finite(lower) || !finite(upper) || glm::any(glm::greaterThan(lower, upper))) {
    throw Error(ErrorCode::input,
                fmt::format("the domain must be a box of finite corners, the lower first, not [{}, {}, {}] to "
                            "[{}, {}, {}]",
                            lower.x, lower.y, lower.z, upper.x, upper.y, upper.z));
  }
  if (!(domain.radius >= 0) || !std::isfinite(domain.radius))
    throw Error(ErrorCode::input, fmt::format("the radius of the domain must be positive, not {}", domain.radius));
}

std::uint32_t ImplicitSurface::properties() const {
  return Property::value | Property::normal | Property::gauss | Property::mean | Property::principal |
         Property::directions | Property::normal_curvature;
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
  return AnalyticField{std::move(value), sign * level, {domain.lower, domain.upper, domain.radius}};
}

std::unique_ptr<ResidentSurface> ImplicitSurface::reside(Executor& executor) const {
  return std::make_unique<ResidentImplicit>(*this, executor);
}

}  // namespace smurf
