// Implicit surfaces and isosurfaces of expressions, from API calls and descriptions.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "expression/files.hpp"
#include "expression/parser.hpp"
#include "io/description.hpp"
#include "numerics/text_file.hpp"
#include "smurf/black_box.hpp"
#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "surfaces/implicit/definition.hpp"

namespace smurf {

using nlohmann::json;

namespace {

constexpr double algebraic_radius = 5;  // of the ball that .jsurf files are shown in, unless they are given a domain

std::shared_ptr<const ImplicitFunction> function_of(std::string_view text, const Parameters& parameters) {
  static const std::vector<std::string> variables{"x", "y", "z"};
  expression::Graph graph;
  const expression::NodeId value = expression::parse(graph, text, variables, parameters);
  return differentiated(std::move(graph), value);
}

}  // namespace

Surface implicit(std::string_view equation, const Domain& domain, const Parameters& parameters) {
  return Surface(std::make_shared<const ImplicitSurface>("implicit", std::string(equation),
                                                         function_of(equation, parameters), 0,
                                                         ImplicitSurface::Side::out_of_smaller, domain));
}

Surface isosurface(std::string_view expression, double isovalue, const Domain& domain, const Parameters& parameters) {
  return Surface(std::make_shared<const ImplicitSurface>("isosurface", std::string(expression),
                                                         function_of(expression, parameters), isovalue,
                                                         ImplicitSurface::Side::out_of_greater, domain));
}

Surface load_implicit(const std::filesystem::path& file, const std::optional<Domain>& domain) {
  const bool tape = file.extension() == ".vm";
  expression::ImplicitFile read = tape ? expression::load_vm(file) : expression::load_jsurf(file);
  Domain where{glm::dvec3(-algebraic_radius), glm::dvec3(algebraic_radius), algebraic_radius};
  if (domain) {
    where = *domain;
  } else if (tape) {
    where = {glm::dvec3(-1), glm::dvec3(1), 0};
  }
  return Surface(std::make_shared<const ImplicitSurface>(
      "implicit", read.title.empty() ? file.filename().string() : read.title,
      differentiated(std::move(read.graph), read.root), 0, ImplicitSurface::Side::out_of_smaller, where));
}

namespace {

// A black box: "source" is a file of device code; "equation", if there is one, is the same function for the reference.
std::shared_ptr<const SurfaceDefinition> read_black_box(const json& root, const std::filesystem::path& folder) {
  description::only_members(root, "",
                            {"kind", "source", "equation", "parameters", "domain", "radius", "level", "step",
                             "lipschitz", "difference_order", "difference_step"});
  BlackBox function;
  function.name = description::text_member(root, "", "source");
  function.source = description::named("", "source", [&] { return read_file(folder / function.name); });
  const Domain domain = description::required_domain(root, "");
  if (root.contains("equation")) {
    const std::string equation = description::text_member(root, "", "equation");
    const Parameters parameters = description::parameters(root, "");
    const Surface same = description::named("", "equation", [&] { return implicit(equation, domain, parameters); });
    function.value = same.model().analytic_field()->value;
    // The field's normals point to smaller values.
    function.value = [value = std::move(function.value)](const glm::dvec3& point) { return -value(point); };
  } else if (root.contains("parameters")) {
    throw Error(ErrorCode::input, "member \"parameters\" belongs to an \"equation\", which is missing");
  }
  BlackBoxOptions options;
  const auto read = [&](const char* name, double& number) {
    if (root.contains(name)) number = description::number_member(root, "", name);
  };
  double order = options.difference_order;
  read("level", options.level);
  read("step", options.step);
  read("lipschitz", options.lipschitz);
  read("difference_order", order);
  read("difference_step", options.difference_step);
  if (order != 2 && order != 4 && order != 6)
    throw Error(ErrorCode::input, fmt::format("member \"difference_order\" must be 2, 4 or 6, not {}", order));
  options.difference_order = int(order);
  return implicit(function, domain, options).share();
}

}  // namespace

std::shared_ptr<const SurfaceDefinition> read_implicit(const json& root, const std::filesystem::path& folder) {
  if (root.contains("source")) return read_black_box(root, folder);
  description::only_members(root, "", {"kind", "equation", "file", "domain", "radius", "parameters"});
  if (root.contains("file")) {
    if (root.contains("equation"))
      throw Error(ErrorCode::input, "members \"equation\" and \"file\" exclude each other");
    const std::string file = description::text_member(root, "", "file");
    const auto domain = description::domain(root, "");
    return description::named("", "file", [&] { return load_implicit(folder / file, domain).share(); });
  }
  const std::string equation = description::text_member(root, "", "equation");
  const Domain domain = description::required_domain(root, "");
  const Parameters parameters = description::parameters(root, "");
  return description::named("", "equation", [&] { return implicit(equation, domain, parameters).share(); });
}

std::shared_ptr<const SurfaceDefinition> read_expression_isosurface(const json& field, const std::filesystem::path&,
                                                                    double isovalue) {
  description::only_members(field, "field", {"kind", "value", "domain", "radius", "parameters"});
  const std::string text = description::text_member(field, "field", "value");
  const Domain domain = description::required_domain(field, "field");
  const Parameters parameters = description::parameters(field, "field");
  return description::named("field", "value", [&] { return isosurface(text, isovalue, domain, parameters).share(); });
}

}  // namespace smurf
