// A libFuzzer target for what reads expressions: the parser, .jsurf and .vm files. The first byte says which. What is
// accepted is also differentiated, evaluated, bounded and written as source. Only an Error may leave, of one line.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "expression/evaluate.hpp"
#include "expression/files.hpp"
#include "expression/interval.hpp"
#include "expression/parser.hpp"
#include "expression/source.hpp"
#include "smurf/error.hpp"

namespace {

using namespace smurf::expression;

void require(bool condition) {
  if (!condition) std::abort();
}

void use(Graph& graph, NodeId root) {
  const std::array<double, 3> point = {0.5, -1.25, 0};
  std::vector<NodeId> roots = {root};
  if (graph.size() < 10'000)
    for (int i = 0; i < 3; i++) roots.push_back(derivative(graph, root, i));
  polynomial_degree(graph, root);

  std::vector<double> scratch, values(roots.size());
  Evaluator(graph, roots)(point, values, scratch);
  std::array<Interval, 3> box;
  for (std::size_t i = 0; i < 3; i++) box[i] = {point[i], point[i] + 0.125, true};
  std::vector<Interval> interval_scratch, bounds(roots.size());
  IntervalEvaluator(graph, roots)(box, bounds, interval_scratch);
  bool finite = true;
  for (const double v : scratch) finite = finite && !std::isinf(v);
  for (std::size_t i = 0; i < roots.size(); i++) {
    require(bounds[i].low <= bounds[i].high);
    if (finite) require(std::isnan(values[i]) ? !bounds[i].defined : bounds[i].contains(values[i]));
  }
  std::vector<std::string> names;
  device_source(graph, roots, "f_", names);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  static const std::vector<std::string> variables = {"x", "y", "z"};
  static const std::map<std::string, double> parameters = {{"a", 1.5}, {"b", 0}};
  try {
    if (data[0] % 3 == 0) {
      Graph graph;
      use(graph, parse(graph, text, variables, parameters));
    } else {
      ImplicitFile file = data[0] % 3 == 1 ? parse_jsurf(text, "fuzz.jsurf") : parse_vm(text, "fuzz.vm");
      use(file.graph, file.root);
    }
  } catch (const smurf::Error& error) {
    require(error.code() == smurf::ErrorCode::input);
    require(std::string_view(error.what()).find_first_of("\r\n") == std::string_view::npos);
    require(std::string_view(error.what()).size() < 2000);
  }
  return 0;
}
